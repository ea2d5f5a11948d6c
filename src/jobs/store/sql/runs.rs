//! What is kept of runs beside their chunks.

use super::engine::SqlStore;
use super::rows::read_count;
use sqlx::Row;

use uuid::Uuid;

use crate::jobs::model::batch::RunRecord;
use crate::jobs::store_error::StoreError;

/// Of a chunk, `field_patches` counts the rows without an answer.
const GET: &str = "SELECT body, \
     (SELECT CAST(COALESCE(SUM(field_patches), 0) AS bigint) FROM jobs WHERE batch_id = batches.id AND state = 'succeeded') AS without_answer, \
     (SELECT CAST(COALESCE(SUM(progress), 0.0) AS double precision) FROM jobs WHERE batch_id = batches.id AND state = 'running') AS running \
     FROM batches JOIN batch_templates ON batch_templates.batch_id = batches.id \
     WHERE batches.id = $1 AND tenant = $2 AND complete = 1";

impl SqlStore {
    /// The head of a run and how far its chunks are.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn run(
        &self,
        tenant: &str,
        id: Uuid,
    ) -> Result<Option<RunRecord>, StoreError> {
        let row = sqlx::query(GET)
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        let Some(row) = row else { return Ok(None) };
        let head: Vec<u8> = row.try_get("body")?;
        Ok(Some(RunRecord {
            head: head.into(),
            without_answer: read_count(&row, "without_answer")?,
            running: row.try_get("running")?,
        }))
    }
}
