//! SQLite as the shared statements see it.

use std::ffi::OsString;
use std::path::Path;

use uuid::Uuid;

use crate::model::Queue;
use crate::store::sqlite::connection::{Query, Transaction};
use crate::store::sqlite::database::SqliteStore;
use crate::store::sqlite::sql::claim::{claimed, peek};
use crate::store::sqlite::sql::rows::count;
use crate::store::{ClaimKind, ClaimRequest, Cluster, Result};

pub(crate) use crate::store::sqlite::connection::{
    Connection as DbConnection, Pool as DbPool, QueryBuilder, Row, SqliteRow as DbRow, query,
    query_scalar,
};

pub(crate) type SqlStore = SqliteStore;

/// What stands before and behind the present by which leases are judged, a value.
pub(crate) const LEASE_NOW: (&str, &str) = ("", "");

macro_rules! claim {
    ($begun:literal, $most:literal) => {
        concat!(
            "WITH queued AS MATERIALIZED (",
            peek!($begun, $most, "$11"),
            "), placed AS (SELECT id, ROW_NUMBER() OVER in_order AS place, SUM(cost_us) OVER in_order AS cost_us, \
                 SUM(suspect) OVER in_order AS suspects FROM queued WINDOW in_order AS (ORDER BY rank, id)), \
             chosen AS MATERIALIZED (SELECT id FROM placed WHERE place = 1 OR (cost_us <= $6 AND suspects = 0)) \
             UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_token = $7, lease_until = $8, worker = $9, \
             started_at = $10, updated_at = $10, group_size = (SELECT COUNT(*) FROM chosen), \
             progress = done, version = version + 1 \
             WHERE id IN (SELECT id FROM chosen) RETURNING ",
            claimed!()
        )
    };
}

/// Claims the first new jobs of a queue.
pub(crate) const CLAIM_NEW: &str = claim!("slices = 0", "$2");

/// Claims the first job of a queue of which some slices are solved.
pub(crate) const CLAIM_BEGUN: &str = claim!("slices > 0", "1");

/// Begins a transaction that writes.
pub(crate) async fn begin(writer: &DbPool) -> Result<Transaction> {
    writer.begin().await
}

/// Passes each row of a statement on until `row` returns `false`.
pub(crate) async fn for_each(
    rows: Query,
    readers: &DbPool,
    row: impl FnMut(&DbRow) -> Result<bool> + Send,
) -> Result<()> {
    rows.for_each(readers, row).await
}

/// From here to the end of the transaction nobody else takes places in the queue or uses an idempotency key: there is one
/// writer.
pub(crate) async fn lock_admission(_: &mut DbConnection) -> Result<()> {
    Ok(())
}

/// Keeps jobs from being removed until the end of the transaction: there is one writer.
pub(crate) async fn lock_jobs_for_share(_: &mut DbConnection, _: &[Uuid]) -> Result<()> {
    Ok(())
}

/// Keeps others from counting the references to blobs until the end of the transaction: there is one writer.
pub(crate) async fn lock_blobs(_: &mut DbConnection, _: &[i64]) -> Result<()> {
    Ok(())
}

/// Makes a call; with one writer none has to give way to another.
pub(crate) async fn again<T, F: Future<Output = Result<T>>>(call: impl Fn() -> F) -> Result<T> {
    call().await
}

impl SqliteStore {
    /// Ids for new blobs. An id is never used twice, so that a reader cannot meet the result of another job under it.
    pub(crate) async fn new_blob_ids(
        &self,
        connection: &mut DbConnection,
        number: usize,
    ) -> Result<Vec<i64>> {
        let last = query("SELECT seq FROM sqlite_sequence WHERE name = 'blobs'");
        let last = last.fetch_optional(connection).await?;
        let last: i64 = last.map_or(Ok(0), |row| row.try_get("seq"))?;
        Ok((last + 1..).take(number).collect())
    }

    /// Claims the next jobs of a queue; rows with the columns of `claimed`.
    pub(crate) async fn claim_next(
        &self,
        request: &ClaimRequest<'_>,
        token: i64,
    ) -> Result<Vec<DbRow>> {
        let claim = match request.kind {
            ClaimKind::New => CLAIM_NEW,
            ClaimKind::Begun => CLAIM_BEGUN,
        };
        // A claim that a power cut undoes leaves its jobs in the queue.
        let mut transaction = self.writer.begin_relaxed().await?;
        let rows = sql!(fetch_all, &mut *transaction,
            claim;
            &*request.queue.tenant, count(request.jobs), request.late_before,
            request.each_slice_us.map_or(i64::MAX, count), request.queue.kind.name(),
            count(request.cost_us), token, request.lease.now.saturating_add(request.lease.ms),
            request.worker, request.now, i64::from(request.suspects)
        )?;
        transaction.commit().await?;
        Ok(rows)
    }

    /// The present by which leases are judged: that of the one process.
    pub(crate) fn lease_now(&self, now: i64) -> Option<i64> {
        Some(now)
    }

    /// Not cached: the query is cheap.
    pub(crate) fn known_queues(&self) -> Option<Vec<(Queue, u64)>> {
        None
    }

    pub(crate) fn remember_queues(&self, _: &[(Queue, u64)]) {}

    /// Every claim walks the queue from its start.
    pub(crate) fn requeued(&self) {}

    /// One process at a time uses it.
    pub(crate) fn as_cluster(&self) -> Option<&dyn Cluster> {
        None
    }

    /// Size of the file and its write-ahead log.
    pub(crate) async fn database_bytes(&self) -> Result<u64> {
        let mut log = OsString::from(self.file.as_os_str());
        log.push("-wal");
        Ok(size(&self.file).await + size(Path::new(&log)).await)
    }

    /// Gives at most `step` free pages of the file back, if there are more than `spare`; says whether it did.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn compact(&self, spare: i64, step: u32) -> Result<bool> {
        let free: i64 = sql!(scalar fetch_one, &self.readers, "PRAGMA freelist_count")?;
        if free <= spare {
            return Ok(false);
        }
        let step = i64::from(step).min(free - spare);
        sql!(
            fetch_all,
            &self.writer,
            format!("PRAGMA incremental_vacuum({step})")
        )?;
        let left: i64 = sql!(scalar fetch_one, &self.writer, "PRAGMA freelist_count")?;
        Ok(left < free)
    }
}

/// Size of a file, 0 if there is none.
async fn size(file: &Path) -> u64 {
    tokio::fs::metadata(file)
        .await
        .map_or(0, |about| about.len())
}
