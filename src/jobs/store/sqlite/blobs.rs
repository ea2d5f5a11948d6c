//! Results in the embedded job table, and who refers to them.
//!
//! A blob is a row; jobs refer to it, lending a result is one more reference. `release_blobs` is the only place where a
//! blob ends: it is called in every transaction that drops references. Only the slices of sweeps have blobs of their own, which
//! nobody else refers to; triggers of the table remove them in the transaction in which their job ends.

use crate::jobs::store::sqlite::rows::push_list;
use crate::jobs::store::sqlite::rows::read_id;
use sqlx::{QueryBuilder, Row, Sqlite, SqliteConnection};
use std::collections::HashSet;
use uuid::Uuid;

use crate::jobs::store::error::StoreError;
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::types::StoredResult;

/// Values bound in one statement; far below the bound of SQLite.
const VALUES_PER_STATEMENT: usize = 250;

/// Stores results within the caller's transaction; the ids of their blobs are in the order of the results.
pub(crate) async fn insert_blobs(
    connection: &mut SqliteConnection,
    results: &[&StoredResult],
) -> Result<Vec<i64>, StoreError> {
    if results.is_empty() {
        return Ok(Vec::new());
    }
    // The ids are given here, not by the database: rows of one statement may come back in any order. An id is never used
    // twice, so that a reader cannot meet the result of another job under it.
    let last: Option<i64> =
        sqlx::query_scalar("SELECT seq FROM sqlite_sequence WHERE name = 'blobs'")
            .fetch_optional(&mut *connection)
            .await?;
    let mut next = last.unwrap_or(0);
    let mut ids = Vec::with_capacity(results.len());
    for some in results.chunks(VALUES_PER_STATEMENT) {
        let mut insert =
            QueryBuilder::<Sqlite>::new("INSERT INTO blobs (id, key, bytes, solution, fields) ");
        insert.push_values(some, |mut row, result| {
            next += 1;
            ids.push(next);
            let (key, inside) = match result {
                StoredResult::Blob(key, _) => (Some(key.as_str()), None),
                StoredResult::Inline(result) => (None, Some(result)),
            };
            row.push_bind(next)
                .push_bind(key)
                .push_bind(i64::try_from(result.bytes()).unwrap_or(i64::MAX))
                .push_bind(inside.map(|result| result.solution.as_ref()))
                .push_bind(inside.and_then(|result| result.fields.as_deref()));
        });
        insert.build().execute(&mut *connection).await?;
    }
    Ok(ids)
}

/// Removes those of these blobs that no job refers to any more; the keys of the large ones enter the outbox.
pub(crate) async fn release_blobs(
    connection: &mut SqliteConnection,
    mut ids: Vec<i64>,
) -> Result<(), StoreError> {
    ids.sort_unstable();
    ids.dedup();
    for some in ids.chunks(VALUES_PER_STATEMENT) {
        let mut free = QueryBuilder::<Sqlite>::new("DELETE FROM blobs WHERE id IN (");
        let mut list = free.separated(", ");
        for id in some {
            list.push_bind(*id);
        }
        free.push(
            ") AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id) RETURNING key",
        );
        let gone = free.build().fetch_all(&mut *connection).await?;
        let keys = gone
            .iter()
            .map(|row| row.try_get::<Option<String>, _>("key"));
        let keys = keys.collect::<Result<Vec<_>, _>>()?;
        let keys: Vec<String> = keys.into_iter().flatten().collect();
        leave_to_collector(connection, &keys).await?;
    }
    Ok(())
}

async fn leave_to_collector(
    connection: &mut SqliteConnection,
    keys: &[String],
) -> Result<(), StoreError> {
    for some in keys.chunks(VALUES_PER_STATEMENT) {
        let mut leave = QueryBuilder::<Sqlite>::new("INSERT INTO blob_outbox (key) ");
        leave.push_values(some, |mut row, key| {
            row.push_bind(key);
        });
        leave.push(" ON CONFLICT DO NOTHING");
        leave.build().execute(&mut *connection).await?;
    }
    Ok(())
}

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

fn push_keys(query: &mut QueryBuilder<Sqlite>, keys: &[String]) {
    let mut list = query.separated(", ");
    for key in keys {
        list.push_bind(key.clone());
    }
    query.push(")");
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
        let free = "DELETE FROM blobs WHERE id IN (1, 2) AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id)";
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
