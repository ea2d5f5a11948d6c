//! SQLite as the shared statements see it.

use std::ffi::OsString;
use std::path::Path;

use async_trait::async_trait;
use uuid::Uuid;

use crate::model::Queue;
use crate::store::sqlite::connection::{Query, Transaction};
use crate::store::sqlite::database::SqliteStore;
use crate::store::sqlite::schema::mark;
use crate::store::sqlite::sql::claim::{PEEK, first_queued};
use crate::store::{ClaimRequest, Cluster, Result, Store};

pub(crate) use crate::store::sqlite::connection::{
    Connection as DbConnection, Pool as DbPool, QueryBuilder, Row, SqliteRow as DbRow, query,
    query_scalar,
};

pub(crate) type SqlStore = SqliteStore;

/// What stands before and behind the present by which leases are judged, a value.
pub(crate) const LEASE_NOW: (&str, &str) = ("", "");

/// Begins a transaction that writes.
pub(crate) async fn begin(writer: &DbPool) -> Result<Transaction> {
    writer.begin().await
}

/// Begins a transaction that claims: a claim that a power cut undoes leaves its jobs in the queue.
pub(crate) async fn begin_claim(writer: &DbPool) -> Result<Transaction> {
    writer.begin_relaxed().await
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

    /// The first new jobs of a queue.
    pub(crate) async fn first_new(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<Vec<DbRow>> {
        first_queued(connection, PEEK, request, request.jobs).await
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

    /// Size of the file and its write-ahead log.
    pub(crate) async fn database_bytes(&self) -> Result<u64> {
        let mut log = OsString::from(self.file.as_os_str());
        log.push("-wal");
        Ok(size(&self.file).await + size(Path::new(&log)).await)
    }
}

#[async_trait]
impl Store for SqliteStore {
    async fn ready(&self, write: bool) -> Result<()> {
        if write {
            return mark(&self.writer).await;
        }
        sql!(fetch_optional, &self.readers, "SELECT 1 FROM jobs LIMIT 1")?;
        Ok(())
    }

    fn cluster(&self) -> Option<&dyn Cluster> {
        None
    }

    /// The write-ahead log is folded into the database.
    async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }

    async fn compact(&self, spare: i64, step: u32) -> Result<bool> {
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
