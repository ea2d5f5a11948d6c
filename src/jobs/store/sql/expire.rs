//! Removal of what has expired, and of the space it took, in the embedded job table.

use super::blob_refs::release_blobs;
use super::engine::{self, Db, SqlStore};
use super::rows::{push_list, read_blob_ids, read_id};
use sqlx::QueryBuilder;
use uuid::Uuid;

use crate::jobs::store::list::first_id_at;
use crate::jobs::store::retention::RetentionRule;
use crate::jobs::store_error::StoreError;

/// Ids grow with the time of submission, so that only the oldest rows are read. Chunks of a run expire with the last of
/// them.
pub(crate) const EXPIRED: &str = concat!(
    "SELECT id, blob_id FROM jobs \
     WHERE id < $1 AND ended_at <= $2 \
     AND (batch_id IS NULL OR kind = 'case' \
     OR NOT EXISTS (SELECT 1 FROM batches WHERE batches.id = jobs.batch_id AND batches.ended_at > $2) \
     AND NOT EXISTS (SELECT 1 FROM jobs AS beside WHERE beside.batch_id = jobs.batch_id AND beside.state IN ('queued', 'running'))) \
     ORDER BY id LIMIT $3",
    skip_locked!()
);

impl SqlStore {
    /// Removes expired jobs, complete batches of that age without jobs, and ids remembered long enough. Returns the number
    /// of jobs removed.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub(crate) async fn expire(&self, expiry: RetentionRule) -> Result<u64, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let young = first_id_at(expiry.ended_before.saturating_add(1)).to_string();
        let rows = sqlx::query(EXPIRED)
            .bind(&young)
            .bind(expiry.ended_before)
            .bind(i64::from(expiry.jobs))
            .fetch_all(&mut *transaction)
            .await?;
        let mut blobs = Vec::with_capacity(rows.len());
        for some in rows.chunks(250) {
            let ids = some.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
            blobs.extend(read_blob_ids(some)?);
            let mut bury = QueryBuilder::<Db>::new(
                "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, ",
            );
            bury.push_bind(expiry.now);
            bury.push(" FROM jobs WHERE id IN (");
            push_list(&mut bury, &ids);
            bury.push(") ON CONFLICT (id) DO NOTHING");
            bury.build().execute(&mut *transaction).await?;
            let mut delete = QueryBuilder::<Db>::new("DELETE FROM jobs WHERE id IN (");
            push_list(&mut delete, &ids);
            delete.push(")");
            delete.build().execute(&mut *transaction).await?;
        }
        release_blobs(&mut transaction, blobs).await?;
        sqlx::query(
            "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, $1 FROM batches \
             WHERE id < $2 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id) \
             ON CONFLICT (id) DO NOTHING",
        )
        .bind(expiry.now)
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        sqlx::query(
            "DELETE FROM batches \
             WHERE id < $1 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)",
        )
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        sqlx::query("DELETE FROM tombstones WHERE id < $1 AND gone_at <= $2")
            .bind(first_id_at(expiry.forget_before.saturating_add(1)).to_string())
            .bind(expiry.forget_before)
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(rows.len() as u64)
    }

    /// Was there a job or a batch of this tenant with this id that has expired?
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool, StoreError> {
        let found = sqlx::query("SELECT 1 FROM tombstones WHERE id = $1 AND tenant = $2")
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        Ok(found.is_some())
    }
}
