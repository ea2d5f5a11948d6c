//! What is kept of runs beside their chunks.

use super::engine::SqlStore;
use super::rows::read_count;
use sqlx::Row;

use bytes::Bytes;
use uuid::Uuid;

use crate::jobs::model::batch::RunRecord;
use crate::jobs::store_error::StoreError;

/// Of a chunk, `field_patches` counts the rows without an answer.
const GET: &str = "SELECT body, head, \
     (SELECT CAST(COALESCE(SUM(field_patches), 0) AS bigint) FROM jobs WHERE batch_id = batches.id AND state = 'succeeded') AS without_answer, \
     (SELECT CAST(COALESCE(SUM(progress), 0.0) AS double precision) FROM jobs WHERE batch_id = batches.id AND state = 'running') AS running \
     FROM batches JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
     WHERE batches.id = $1 AND batches.tenant = $2 AND kind = 'rows' AND complete = 1";

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
        let template: Vec<u8> = row.try_get("body")?;
        let head: Option<Vec<u8>> = row.try_get("head")?;
        Ok(Some(RunRecord {
            template: template.into(),
            head: head.map(Bytes::from),
            without_answer: read_count(&row, "without_answer")?,
            running: row.try_get("running")?,
        }))
    }
}
