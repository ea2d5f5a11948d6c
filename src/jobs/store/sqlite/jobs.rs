//! What clients ask of one job.

use crate::jobs::store::sqlite::rows::GET;

use sqlx::Row;
use uuid::Uuid;

use crate::jobs::codec::result::EncodedResult;
use crate::jobs::error::JobsError;
use crate::jobs::model::Job;
use crate::jobs::store::sqlite::blobs::release_blobs;
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{job_columns, read_blob_id, read_job};
use crate::jobs::store::types::{Deleted, ResultRef};

impl SqliteStore {
    /// Cancels a queued job at once and asks the worker of a running one to stop; an ended job stays as it is.
    /// Returns the job as it then is, `None` if there is none.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn cancel(&self, id: Uuid, now: i64) -> Result<Option<Job>, JobsError> {
        let row = sqlx::query(concat!(
            "UPDATE jobs SET state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
             ended_at = CASE WHEN state = 'queued' THEN $1 ELSE NULL END, \
             cancel_requested = 1, version = version + 1 \
             WHERE id = $2 AND cancel_requested = 0 AND state IN ('queued', 'running') RETURNING ",
            job_columns!()
        ))
        .bind(now)
        .bind(id.to_string())
        .fetch_optional(&self.writer)
        .await?;
        match row {
            Some(row) => read_job(&row).map(Some),
            None => self.get(id).await,
        }
    }

    /// Removes an ended job with its case, labels and idempotency key.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn delete(&self, id: Uuid) -> Result<Deleted, JobsError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let gone = sqlx::query(
            "DELETE FROM jobs WHERE id = $1 AND state IN ('succeeded', 'failed', 'cancelled') RETURNING blob_id",
        )
        .bind(id.to_string())
        .fetch_optional(&mut *transaction)
        .await?;
        if let Some(row) = gone {
            release_blobs(&mut transaction, read_blob_id(&row)?.into_iter().collect()).await?;
            transaction.commit().await?;
            return Ok(Deleted::Done);
        }
        drop(transaction);
        let job = self.get(id).await?;
        Ok(job.map_or(Deleted::NotFound, |job| Deleted::NotEnded(job.state)))
    }

    /// Looks at one job.
    ///
    /// # Errors
    /// The database failed.
    pub async fn get(&self, id: Uuid) -> Result<Option<Job>, JobsError> {
        let row = sqlx::query(GET)
            .bind(id.to_string())
            .fetch_optional(&self.readers)
            .await?;
        row.as_ref().map(read_job).transpose()
    }

    /// The result of a job that lies in the database: its solution and its fields.
    ///
    /// # Errors
    /// The database failed.
    pub async fn small_result(&self, id: Uuid) -> Result<Option<EncodedResult>, JobsError> {
        let row = sqlx::query(
            "SELECT solution, fields FROM jobs JOIN blobs ON blobs.id = jobs.blob_id \
             WHERE jobs.id = $1 AND key IS NULL",
        )
        .bind(id.to_string())
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let solution: Vec<u8> = row.try_get("solution")?;
        let fields: Option<Vec<u8>> = row.try_get("fields")?;
        Ok(Some(EncodedResult {
            solution: solution.into(),
            fields: fields.map(Into::into),
        }))
    }

    /// A job with the place of its result, if it has one.
    ///
    /// # Errors
    /// The database failed.
    pub async fn result(&self, id: Uuid) -> Result<Option<(Job, Option<ResultRef>)>, JobsError> {
        let row = sqlx::query(concat!(
            "SELECT ",
            job_columns!(),
            ", blob_id, field_patches, outputs, (SELECT key FROM blobs WHERE blobs.id = blob_id) AS key \
             FROM jobs WHERE id = $1"
        ))
        .bind(id.to_string())
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let patches: u32 = row.try_get("field_patches")?;
        let stored = match read_blob_id(&row)? {
            None => None,
            Some(_) => Some(ResultRef {
                job: id,
                key: row.try_get("key")?,
                field_patches: patches as usize,
                outputs: row.try_get("outputs")?,
            }),
        };
        Ok(Some((read_job(&row)?, stored)))
    }
}
