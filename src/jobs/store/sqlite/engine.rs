//! The interface of SQLite for the shared statements.

use std::ffi::OsString;
use std::path::Path;
use std::sync::Arc;

use async_trait::async_trait;
use tokio::runtime::Handle;
use uuid::Uuid;

use crate::error::StoreError;
use crate::model::Queue;
use crate::store::sqlite::connection::{Pooled, Query};
use crate::store::sqlite::database::SqliteStore;
use crate::store::sqlite::schema::mark;
use crate::store::sqlite::sql::claim::{PEEK, first_queued};
use crate::store::{ClaimRequest, Cluster, Result, Store};

pub(crate) use crate::store::sqlite::connection::{
    Connection as DbConnection, Pool as DbPool, Row, SqliteRow as DbRow, query, query as built,
    query_scalar,
};

pub(crate) type SqlStore = SqliteStore;

/// Runs the task that stores submitted jobs on a separate thread, which may wait for the disk.
pub(crate) fn spawn(task: impl Future<Output = ()> + Send + 'static) -> Result<()> {
    let runtime = Handle::current();
    let thread = std::thread::Builder::new().name("railhead-commit".to_owned());
    let started = thread.spawn(move || runtime.block_on(task));
    started.map_err(|error| StoreError::Failed(Arc::new(error)))?;
    Ok(())
}

/// Begins a write transaction.
pub(crate) async fn begin(writer: &DbPool) -> Result<Pooled> {
    writer.begin(false).await
}

/// Begins a transaction that claims. A power cut may undo a claim, which leaves its jobs in the queue.
pub(crate) async fn begin_claim(writer: &DbPool) -> Result<Pooled> {
    writer.begin(true).await
}

/// Appends the placeholder of a parameter. SQLite searches the names of earlier parameters, so they have none.
pub(crate) fn push_placeholder(text: &mut String, _: usize) {
    text.push('?');
}

/// Passes each row of a statement to `row` until that returns `false`.
pub(crate) async fn for_each(
    rows: Query,
    readers: &DbPool,
    row: impl FnMut(&DbRow) -> Result<bool> + Send,
) -> Result<()> {
    rows.for_each(readers, row).await
}

/// Until the end of the transaction no other one takes places in the queue or uses idempotency keys; there is one writer.
pub(crate) async fn lock_admission(_: &mut DbConnection) -> Result<()> {
    Ok(())
}

/// Prevents the removal of jobs until the end of the transaction; there is one writer.
pub(crate) async fn lock_jobs_for_share(_: &mut DbConnection, _: &[Uuid]) -> Result<()> {
    Ok(())
}

/// Prevents changes of the references to blobs until the end of the transaction; there is one writer.
pub(crate) async fn lock_blobs(_: &mut DbConnection, _: &[i64]) -> Result<()> {
    Ok(())
}

/// Runs a call; with one writer there are no conflicts that would require a repetition.
pub(crate) async fn again<T, F: Future<Output = Result<T>>>(call: impl Fn() -> F) -> Result<T> {
    call().await
}

impl SqliteStore {
    /// New ids of blobs. An id is never reused, so that a reader cannot get the result of another job.
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

    /// Selects the first new jobs of a queue.
    pub(crate) async fn first_new(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<Vec<DbRow>> {
        first_queued(connection, PEEK, request, request.jobs).await
    }

    /// The current time by which leases are judged: that of this process.
    pub(crate) fn lease_now(&self, now: i64) -> Option<i64> {
        Some(now)
    }

    /// Queues are not cached, because the query is cheap.
    pub(crate) fn known_queues(&self) -> Option<Vec<(Queue, u64)>> {
        None
    }

    pub(crate) fn remember_queues(&self, _: &[(Queue, u64)]) {}

    /// Does nothing: this store caches nothing between claims.
    pub(crate) fn requeued(&self) {}

    /// Size of the file and its write-ahead log in bytes.
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

    /// Closing checkpoints the write-ahead log.
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

/// Size of a file in bytes, 0 if it does not exist.
async fn size(file: &Path) -> u64 {
    tokio::fs::metadata(file)
        .await
        .map_or(0, |about| about.len())
}
