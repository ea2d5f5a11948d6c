//! What clients ask of one job.

use super::blob_refs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, Row, SqlStore, query};
use super::rows::{
    GET, job_columns, read_blob_id, read_count, read_flag, read_job, read_kind, read_small,
};
use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::store::ending::StoredResult;
use crate::jobs::store::submission::StoredCase;
use bytes::Bytes;

use uuid::Uuid;

use crate::jobs::model::job::Job;
use crate::jobs::store::ClientJobs;
use crate::jobs::store::ending::ResultRef;
use crate::jobs::store::retention::Deleted;
use crate::jobs::store_error::StoreError;

#[repeat_conflicts]
#[async_trait]
impl ClientJobs for SqlStore {
    async fn cancel(&self, tenant: &str, id: Uuid, now: i64) -> Result<Option<Job>, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let row = query(concat!(
            "UPDATE jobs SET state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
             ended_at = CASE WHEN state = 'queued' THEN $1 ELSE NULL END, \
             cancel_requested = 1, version = version + 1, updated_at = $1 \
             WHERE id = $2 AND tenant = $3 AND kind <> 'rows' AND cancel_requested = 0 AND state IN ('queued', 'running') RETURNING ",
            job_columns!(),
            ", slices"
        ))
        .bind(now)
        .bind(id.to_string())
        .bind(tenant)
        .fetch_all(&mut *transaction)
        .await?;
        drop_slices_of_ended(&mut transaction, &row).await?;
        transaction.commit().await?;
        match row.first() {
            Some(row) => read_job(row).map(Some),
            None => self.job(tenant, id).await,
        }
    }

    async fn delete(&self, tenant: &str, id: Uuid) -> Result<Deleted, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let gone = query(
            "DELETE FROM jobs WHERE id = $1 AND tenant = $2 AND kind <> 'rows' AND state IN ('succeeded', 'failed', 'cancelled') RETURNING blob_id",
        )
        .bind(id.to_string())
        .bind(tenant)
        .fetch_optional(&mut *transaction)
        .await?;
        if let Some(row) = gone {
            release_blobs(&mut transaction, read_blob_id(&row)?.into_iter().collect()).await?;
            transaction.commit().await?;
            return Ok(Deleted::Done);
        }
        drop(transaction);
        let job = self.job(tenant, id).await?;
        Ok(job.map_or(Deleted::NotFound, |job| Deleted::NotEnded(job.state)))
    }

    async fn job(&self, tenant: &str, id: Uuid) -> Result<Option<Job>, StoreError> {
        let row = query(GET)
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        row.as_ref().map(read_job).transpose()
    }

    async fn result(
        &self,
        tenant: &str,
        id: Uuid,
    ) -> Result<Option<(Job, Option<ResultRef>)>, StoreError> {
        let row = query(concat!(
            "SELECT ",
            job_columns!(),
            ", blob_id, field_patches, outputs, blob_key, blob_bytes, solution, fields FROM jobs LEFT JOIN \
             (SELECT id AS blob, key AS blob_key, bytes AS blob_bytes, solution, fields FROM blobs) AS stored ON blob = blob_id \
             WHERE id = $1 AND tenant = $2 AND kind <> 'rows'"
        ))
        .bind(id.to_string())
        .bind(tenant)
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let job = read_job(&row)?;
        if read_blob_id(&row)?.is_none() {
            return Ok(Some((job, None)));
        }
        let patches: u32 = read_small(&row, "field_patches")?;
        let result = match row.try_get::<Option<String>, _>("blob_key")? {
            Some(key) => StoredResult::Blob(key, read_count(&row, "blob_bytes")?),
            None => StoredResult::inline(row.try_get("solution")?, row.try_get("fields")?),
        };
        let stored = ResultRef {
            result,
            field_patches: patches as usize,
            outputs: row.try_get("outputs")?,
        };
        Ok(Some((job, Some(stored))))
    }

    async fn case(&self, tenant: &str, id: Uuid) -> Result<Option<StoredCase>, StoreError> {
        let row = query(
            "SELECT jobs.kind, cases.row, cases.body, head, templates.body AS template FROM jobs JOIN cases ON cases.job_id = jobs.id \
             LEFT JOIN batches ON batches.id = jobs.batch_id \
             LEFT JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
             WHERE jobs.id = $1 AND jobs.tenant = $2",
        )
        .bind(id.to_string())
        .bind(tenant)
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let body: Vec<u8> = row.try_get("body")?;
        let template: Option<Vec<u8>> = match read_flag(&row, "row")? {
            true => row.try_get("template")?,
            false => None,
        };
        let head: Option<Vec<u8>> = row.try_get("head")?;
        Ok(Some(StoredCase {
            kind: read_kind(&row)?,
            template: template.map(Bytes::from),
            head: head.map(Bytes::from),
            body: body.into(),
        }))
    }
}
