//! Large results that nobody refers to any more.

use crate::jobs::store::sqlite::blob_refs::VALUES_PER_STATEMENT;
use crate::jobs::store::sqlite::blob_refs::leave_to_collector;
use crate::jobs::store::sqlite::blob_refs::push_keys;
use crate::jobs::store::sqlite::rows::push_list;
use crate::jobs::store::sqlite::rows::read_id;
use sqlx::{QueryBuilder, Sqlite};
use std::collections::HashSet;
use uuid::Uuid;

use crate::jobs::store::error::StoreError;
use crate::jobs::store::sqlite::database::SqliteStore;

impl SqliteStore {
    /// Keys of large results that are to be removed, at most `limit`; those in `done` are forgotten first.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub(crate) async fn released_blobs(
        &self,
        done: &[String],
        limit: u32,
    ) -> Result<Vec<String>, StoreError> {
        for some in done.chunks(VALUES_PER_STATEMENT) {
            let mut forget = QueryBuilder::<Sqlite>::new("DELETE FROM blob_outbox WHERE key IN (");
            push_keys(&mut forget, some);
            forget.build().execute(&self.writer).await?;
        }
        let keys = sqlx::query_scalar("SELECT key FROM blob_outbox ORDER BY key LIMIT $1")
            .bind(limit)
            .fetch_all(&self.readers)
            .await?;
        Ok(keys)
    }

    /// Leaves a result that was written and that no job will refer to, to be removed.
    ///
    /// # Errors
    /// The database failed; the sweep at the next start will find the result.
    pub(crate) async fn abandon_blob(&self, key: &str) -> Result<(), StoreError> {
        let mut connection = self.writer.acquire().await?;
        leave_to_collector(&mut connection, &[key.to_owned()]).await
    }
}

impl SqliteStore {
    /// Those of these large results that no job refers to, and whose job is not running.
    pub(crate) async fn orphans(
        &self,
        results: &[(Uuid, String)],
    ) -> Result<Vec<String>, StoreError> {
        let mut orphans = Vec::new();
        for some in results.chunks(VALUES_PER_STATEMENT) {
            // In this order: what a running job has written is known by its key before the job no longer runs.
            let running = self.running(some).await?;
            let mut look = QueryBuilder::<Sqlite>::new("SELECT key FROM blobs WHERE key IN (");
            let keys: Vec<String> = some.iter().map(|(_, key)| key.clone()).collect();
            push_keys(&mut look, &keys);
            let known: HashSet<String> = look
                .build_query_scalar::<String>()
                .fetch_all(&self.readers)
                .await?
                .into_iter()
                .collect();
            let orphaned = some
                .iter()
                .filter(|(id, key)| !running.contains(id) && !known.contains(key));
            orphans.extend(orphaned.map(|(_, key)| key.clone()));
        }
        Ok(orphans)
    }

    async fn running(&self, results: &[(Uuid, String)]) -> Result<HashSet<Uuid>, StoreError> {
        let mut query =
            QueryBuilder::<Sqlite>::new("SELECT id FROM jobs WHERE state = 'running' AND id IN (");
        let ids: Vec<Uuid> = results.iter().map(|(id, _)| *id).collect();
        push_list(&mut query, &ids);
        query.push(")");
        let rows = query.build().fetch_all(&self.readers).await?;
        rows.iter().map(read_id).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;
    use crate::jobs::store::sqlite::slices::{NOTES, RESULTS};

    #[tokio::test]
    async fn references_to_a_blob_are_found_by_index() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        let free = "DELETE FROM blobs WHERE id IN (1, 2) AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id) \
            AND NOT EXISTS (SELECT 1 FROM job_slices WHERE job_slices.blob_id = blobs.id)";
        let known = "SELECT key FROM blobs WHERE key IN ('a', 'b')";
        for (statement, seek) in [
            (free, "jobs_by_blob (blob_id=?"),
            (known, "blobs_by_key (key=?"),
        ] {
            let steps = plan(&store, statement).await;
            assert!(steps.iter().any(|step| step.contains(seek)), "{steps:?}");
            assert!(
                !steps.iter().any(|step| step.starts_with("SCAN")),
                "{steps:?}"
            );
        }
    }

    #[tokio::test]
    async fn slices_are_found_by_their_job_and_blobs_by_their_slice() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        // The last is what the database asks itself when a blob goes.
        let referring = "SELECT 1 FROM job_slices WHERE blob_id = 1";
        for (statement, seek) in [
            (NOTES, "PRIMARY KEY (job_id=?"),
            (RESULTS, "PRIMARY KEY (job_id=?"),
            (referring, "job_slices_by_blob (blob_id=?"),
        ] {
            let steps = plan(&store, statement).await;
            assert!(steps[0].contains(seek), "{steps:?}");
            assert!(
                !steps.iter().any(|step| step.starts_with("SCAN")),
                "{steps:?}"
            );
        }
    }
}
