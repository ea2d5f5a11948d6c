//! References to blobs, in the transactions that create and remove them.
//!
//! A blob is a row to which jobs and stored slices refer; jobs that share a result refer to the same blob. Every
//! transaction that removes references calls [`release_blobs`], the only place that removes blobs.
use std::collections::HashSet;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;
use uuid::Uuid;

use super::engine::{self, DbConnection, DbRow, QueryBuilder, Row, SqlStore, query_scalar};
use super::rows::{count, fence, push_list, read_blob_ids, read_id, read_small, read_state};
use crate::store::{Claim, Result, ResultKeys, StoredResult};

/// Number of values bound in one statement; far below the limit of SQLite.
pub(crate) const VALUES_PER_STATEMENT: usize = 250;

impl SqlStore {
    /// Stores results of claimed jobs whose leases are held, within the caller's transaction; the ids of the blobs are in
    /// the order of the results.
    pub(crate) async fn insert_blobs(
        &self,
        connection: &mut DbConnection,
        results: &[(&Claim, &StoredResult)],
    ) -> Result<Vec<i64>> {
        if results.is_empty() {
            return Ok(Vec::new());
        }
        let ids = self.new_blob_ids(connection, results.len()).await?;
        let mut next = ids.iter();
        for some in results.chunks(VALUES_PER_STATEMENT) {
            let mut insert = QueryBuilder::new(
                "WITH made (id, job, lease_token, key, bytes, solution, fields) AS (",
            );
            insert.push_values(some, |mut row, (claim, result)| {
                let (key, inside) = match result {
                    StoredResult::Blob(key, _) => (Some(key.as_str()), None),
                    StoredResult::Inline(result) => (None, Some(result)),
                };
                values!(row;
                    next.next().copied(), claim.id.to_string(), fence(claim), key,
                    count(result.bytes()), inside.map(|result| result.solution.as_ref()),
                    inside.and_then(|result| result.fields.as_deref())
                );
            });
            insert.push(concat!(
                ") INSERT INTO blobs (id, key, bytes, solution, fields, tenant) \
                 SELECT made.id, made.key, made.bytes, made.solution, made.fields, jobs.tenant FROM made JOIN jobs \
                 ON jobs.id = made.job AND jobs.lease_token = made.lease_token WHERE ",
                unordered!("jobs.state"),
                " = 'running'"
            ));
            insert.build().execute(&mut *connection).await?;
        }
        Ok(ids)
    }
}

/// Removes the blobs that have no more references; the keys of large results are added to the outbox.
pub(crate) async fn release_blobs(connection: &mut DbConnection, mut ids: Vec<i64>) -> Result<()> {
    ids.sort_unstable();
    ids.dedup();
    for some in ids.chunks(VALUES_PER_STATEMENT) {
        // Of two transactions that remove the last two references, the second has to see the effect of the first.
        engine::lock_blobs(connection, some).await?;
        let mut free = QueryBuilder::new("DELETE FROM blobs WHERE id IN (");
        let mut list = free.separated(", ");
        for id in some {
            list.push_bind(*id);
        }
        free.push(
            ") AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id) \
             AND NOT EXISTS (SELECT 1 FROM job_slices WHERE job_slices.blob_id = blobs.id) RETURNING key",
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

/// Removes the slices of the jobs that have ended. The rows have the columns `id`, `state` and `slices`.
pub(crate) async fn drop_slices_of_ended(
    connection: &mut DbConnection,
    rows: &[DbRow],
) -> Result<()> {
    let mut ids = Vec::new();
    for row in rows {
        let slices: u32 = read_small(row, "slices")?;
        if slices > 0 && read_state(row)?.ended() {
            ids.push(read_id(row)?);
        }
    }
    for some in ids.chunks(VALUES_PER_STATEMENT) {
        let mut drop = QueryBuilder::new("DELETE FROM job_slices WHERE job_id IN ");
        push_list(&mut drop, some);
        drop.push(" RETURNING blob_id");
        let gone = drop.build().fetch_all(&mut *connection).await?;
        release_blobs(connection, read_blob_ids(&gone)?).await?;
    }
    Ok(())
}

/// Adds keys to the outbox of the collector, except those that another blob has: a repeated call may pass the same key twice.
pub(crate) async fn leave_to_collector(
    connection: &mut DbConnection,
    keys: &[String],
) -> Result<()> {
    for some in keys.chunks(VALUES_PER_STATEMENT) {
        let mut leave = QueryBuilder::new("WITH gone (key) AS (");
        leave.push_values(some, |mut row, key| {
            row.push_bind(key);
        });
        leave.push(
            ") INSERT INTO blob_outbox (key) SELECT key FROM gone \
             WHERE NOT EXISTS (SELECT 1 FROM blobs WHERE blobs.key = gone.key) ON CONFLICT DO NOTHING",
        );
        leave.build().execute(&mut *connection).await?;
    }
    Ok(())
}

#[repeat_conflicts]
#[async_trait]
impl ResultKeys for SqlStore {
    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>> {
        for some in done.chunks(VALUES_PER_STATEMENT) {
            let mut forget = QueryBuilder::new("DELETE FROM blob_outbox WHERE key IN ");
            push_list(&mut forget, some);
            forget.build().execute(&self.writer).await?;
        }
        let keys = sql!(scalar fetch_all, &self.readers,
            "SELECT key FROM blob_outbox ORDER BY key LIMIT $1";
            i64::from(limit)
        )?;
        Ok(keys)
    }

    async fn abandon_blob(&self, key: &str) -> Result<()> {
        let mut connection = self.writer.acquire().await?;
        leave_to_collector(&mut connection, &[key.to_owned()]).await
    }

    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Vec<String>> {
        let mut orphans = Vec::new();
        for some in results.chunks(VALUES_PER_STATEMENT) {
            // In this order: a running job registers the keys of its results before it stops running.
            let running = self.running(some).await?;
            let mut query = QueryBuilder::new("SELECT key FROM blobs WHERE key IN ");
            push_list(&mut query, some.iter().map(|(_, key)| key));
            let known = query.build().fetch_all(&self.readers).await?;
            let known = known.iter().map(|row| row.try_get("key"));
            let known: HashSet<String> = known.collect::<Result<_, _>>()?;
            let lost = some
                .iter()
                .filter(|(id, key)| !known.contains(key) && !running.contains(id));
            orphans.extend(lost.map(|(_, key)| key.clone()));
        }
        Ok(orphans)
    }
}

impl SqlStore {
    async fn running(&self, results: &[(Uuid, String)]) -> Result<HashSet<Uuid>> {
        let mut query = QueryBuilder::new("SELECT id FROM jobs WHERE state = 'running' AND id IN ");
        push_list(&mut query, results.iter().map(|(id, _)| id));
        let rows = query.build().fetch_all(&self.readers).await?;
        rows.iter().map(read_id).collect()
    }
}
