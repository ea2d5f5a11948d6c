//! References to blobs, in the transactions that create and remove them.
//!
//! A blob is a row to which jobs and stored slices refer; jobs that share a result refer to the same blob. Every
//! transaction that removes references calls [`release_blobs`], the only place that removes blobs.
use std::collections::HashSet;

use railhead_macros::store_trait;
use uuid::Uuid;

use super::engine::{self, DbConnection, DbRow, Row, SqlStore, built, query, query_scalar};
use super::rows::{count, fence, read_blob_ids, read_id, read_small, read_state, to_json, values};
use crate::store::{Claim, Result, StoredResult};

/// Number of values bound in one statement; far below the limit of SQLite.
const VALUES_PER_STATEMENT: usize = 250;

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
            let mut insert = built(format!(
                "WITH made (id, job, lease_token, key, bytes, solution, fields) AS ({}) \
                 INSERT INTO blobs (id, key, bytes, solution, fields, tenant) \
                 SELECT made.id, made.key, made.bytes, made.solution, made.fields, jobs.tenant FROM made JOIN jobs \
                 ON jobs.id = made.job AND jobs.lease_token = made.lease_token WHERE jobs.state || '' = 'running'",
                values(some.len(), 7)
            ));
            for (claim, result) in some {
                let (key, inside) = match result {
                    StoredResult::Blob(key, _) => (Some(key.as_str()), None),
                    StoredResult::Inline(result) => (None, Some(result)),
                };
                bind!(insert;
                    next.next().copied(), claim.id.to_string(), fence(claim), key,
                    count(result.bytes()), inside.map(|result| result.solution.as_ref()),
                    inside.and_then(|result| result.fields.as_deref())
                );
            }
            insert.execute(&mut *connection).await?;
        }
        Ok(ids)
    }
}

/// Removes the blobs that have no more references; the keys of large results are added to the outbox.
pub(crate) async fn release_blobs(connection: &mut DbConnection, mut ids: Vec<i64>) -> Result<()> {
    ids.sort_unstable();
    ids.dedup();
    if ids.is_empty() {
        return Ok(());
    }
    // Of two transactions that remove the last two references, the second has to see the effect of the first.
    engine::lock_blobs(connection, &ids).await?;
    let gone = sql!(fetch_all, &mut *connection, RELEASE; to_json(&ids)?)?;
    let keys = gone
        .iter()
        .map(|row| row.try_get::<Option<String>, _>("key"));
    let keys = keys.collect::<Result<Vec<_>, _>>()?;
    let keys: Vec<String> = keys.into_iter().flatten().collect();
    leave_to_collector(connection, &keys).await
}

pub(crate) const RELEASE: &str = concat!(
    "DELETE FROM blobs WHERE id",
    in_list!("$1" "bigint"),
    " AND NOT EXISTS (SELECT 1 FROM jobs WHERE jobs.blob_id = blobs.id) \
     AND NOT EXISTS (SELECT 1 FROM job_slices WHERE job_slices.blob_id = blobs.id) RETURNING key"
);

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
    if ids.is_empty() {
        return Ok(());
    }
    let gone = sql!(fetch_all, &mut *connection,
        concat!("DELETE FROM job_slices WHERE job_id", in_list!("$1"), " RETURNING blob_id");
        to_json(&ids)?
    )?;
    release_blobs(connection, read_blob_ids(&gone)?).await
}

/// Adds keys to the outbox of the collector, except those that another blob has: a repeated call may pass the same key twice.
pub(crate) async fn leave_to_collector(
    connection: &mut DbConnection,
    keys: &[String],
) -> Result<()> {
    if keys.is_empty() {
        return Ok(());
    }
    sql!(execute, connection,
        concat!(
            "WITH gone AS (SELECT value ->> 0 AS key FROM ",
            json_rows!("$1"),
            ") INSERT INTO blob_outbox (key) SELECT key FROM gone \
             WHERE NOT EXISTS (SELECT 1 FROM blobs WHERE blobs.key = gone.key) ON CONFLICT DO NOTHING"
        );
        to_json(&keys.iter().map(|key| [key]).collect::<Vec<_>>())?
    )?;
    Ok(())
}

/// Keys of results outside the table.
#[store_trait]
impl ResultKeys for SqlStore {
    /// Keys of large results without references, at most `limit`; the keys in `done` were removed and are forgotten first.
    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>> {
        if !done.is_empty() {
            sql!(execute, &self.writer,
                concat!("DELETE FROM blob_outbox WHERE key", in_list!("$1"));
                to_json(done)?
            )?;
        }
        let keys = sql!(scalar fetch_all, &self.readers,
            "SELECT key FROM blob_outbox ORDER BY key LIMIT $1";
            i64::from(limit)
        )?;
        Ok(keys)
    }

    /// Registers a large result without a job for removal.
    async fn abandon_blob(&self, key: &str) -> Result<()> {
        let mut connection = self.writer.acquire().await?;
        leave_to_collector(&mut connection, &[key.to_owned()]).await
    }

    /// Selects the results that no job refers to. Results of running jobs are excluded, because the current attempt may
    /// have written them.
    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Vec<String>> {
        let ids: Vec<Uuid> = results.iter().map(|(id, _)| *id).collect();
        let keys: Vec<&str> = results.iter().map(|(_, key)| key.as_str()).collect();
        // In this order: a running job registers the keys of its results before it stops running.
        let running: Vec<String> = sql!(scalar fetch_all, &self.readers,
            concat!("SELECT id FROM jobs WHERE state = 'running' AND id", in_list!("$1"));
            to_json(&ids)?
        )?;
        let known: Vec<String> = sql!(scalar fetch_all, &self.readers, KNOWN; to_json(&keys)?)?;
        let (running, known): (HashSet<String>, HashSet<String>) =
            (running.into_iter().collect(), known.into_iter().collect());
        let lost = results
            .iter()
            .filter(|(id, key)| !known.contains(key) && !running.contains(&id.to_string()));
        Ok(lost.map(|(_, key)| key.clone()).collect())
    }
}

pub(crate) const KNOWN: &str = concat!("SELECT key FROM blobs WHERE key", in_list!("$1"));
