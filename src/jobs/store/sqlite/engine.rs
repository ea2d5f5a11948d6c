//! SQLite as the shared statements see it.

use std::ffi::OsString;
use std::path::Path;

use sqlx::Transaction;
use sqlx::sqlite::{Sqlite, SqliteConnection, SqlitePool, SqliteRow};
use uuid::Uuid;

use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::ClaimRequest;
use crate::jobs::store::cluster::Cluster;
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::sql::claim::{PEEK, count_waiting, first_queued};
use crate::jobs::store_error::StoreError;

pub(crate) type Db = Sqlite;
pub(crate) type DbConnection = SqliteConnection;
pub(crate) type DbPool = SqlitePool;
pub(crate) type DbRow = SqliteRow;
pub(crate) type SqlStore = SqliteStore;

/// What stands before and behind the present by which leases are judged, a value.
pub(crate) const LEASE_NOW: (&str, &str) = ("", "");

/// Begins a transaction that writes. One that reads first and then turns into a writer would fail at once beside another.
pub(crate) async fn begin(pool: &DbPool) -> Result<Transaction<'static, Db>, StoreError> {
    Ok(pool.begin_with("BEGIN IMMEDIATE").await?)
}

/// From here to the end of the transaction nobody else takes places in the queue or uses an idempotency key: there is one
/// writer.
pub(crate) async fn admit_alone(_: &mut DbConnection) -> Result<(), StoreError> {
    Ok(())
}

/// Ids for new blobs. They are given here, not by the insertion: rows of one statement may come back in any order. An id is
/// never used twice, so that a reader cannot meet the result of another job under it.
pub(crate) async fn new_blob_ids(
    connection: &mut DbConnection,
    number: usize,
) -> Result<Vec<i64>, StoreError> {
    let last: Option<i64> =
        sqlx::query_scalar("SELECT seq FROM sqlite_sequence WHERE name = 'blobs'")
            .fetch_optional(connection)
            .await?;
    Ok((last.unwrap_or(0) + 1..).take(number).collect())
}

/// Keeps jobs from being removed until the end of the transaction: there is one writer.
pub(crate) async fn keep_jobs(_: &mut DbConnection, _: &[Uuid]) -> Result<(), StoreError> {
    Ok(())
}

/// Keeps others from counting the references to blobs until the end of the transaction: there is one writer.
pub(crate) async fn lock_blobs(_: &mut DbConnection, _: &[i64]) -> Result<(), StoreError> {
    Ok(())
}

/// Makes a call; with one writer none has to give way to another.
pub(crate) async fn again<T, F: Future<Output = Result<T, StoreError>>>(
    call: impl Fn() -> F,
) -> Result<T, StoreError> {
    call().await
}

impl SqliteStore {
    /// The present by which leases are judged: that of the one process.
    pub(crate) fn lease_now(&self, now: i64) -> Option<i64> {
        Some(now)
    }

    /// Jobs in a queue.
    pub(crate) async fn waiting(
        &self,
        connection: &mut DbConnection,
        queue: &Queue,
    ) -> Result<i64, StoreError> {
        count_waiting(connection, queue).await
    }

    /// The first jobs of a queue.
    pub(crate) async fn peek(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
        most: i64,
    ) -> Result<Vec<DbRow>, StoreError> {
        first_queued(connection, PEEK, request, most).await
    }

    /// Not cached: the query is cheap.
    pub(crate) fn known_queues(&self) -> Option<Vec<Queue>> {
        None
    }

    pub(crate) fn remember_queues(&self, _: &[Queue]) {}

    /// Every claim walks the queue from its start.
    pub(crate) fn requeued(&self) {}

    /// One process at a time uses it.
    pub(crate) fn as_cluster(&self) -> Option<&dyn Cluster> {
        None
    }

    /// Size of the file and its write-ahead log.
    pub(crate) async fn database_bytes(&self) -> Result<u64, StoreError> {
        let mut log = OsString::from(self.file.as_os_str());
        log.push("-wal");
        Ok(size(&self.file).await + size(Path::new(&log)).await)
    }

    /// Gives at most `step` free pages of the file back, if there are more than `spare`; says whether it did.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn compact(&self, spare: i64, step: u32) -> Result<bool, StoreError> {
        let free: i64 = sqlx::query_scalar("PRAGMA freelist_count")
            .fetch_one(&self.readers)
            .await?;
        if free <= spare {
            return Ok(false);
        }
        let step = i64::from(step).min(free - spare);
        sqlx::query(sqlx::AssertSqlSafe(format!(
            "PRAGMA incremental_vacuum({step})"
        )))
        .fetch_all(&self.writer)
        .await?;
        let left: i64 = sqlx::query_scalar("PRAGMA freelist_count")
            .fetch_one(&self.writer)
            .await?;
        Ok(left < free)
    }
}

/// Size of a file, 0 if there is none.
async fn size(file: &Path) -> u64 {
    tokio::fs::metadata(file)
        .await
        .map_or(0, |about| about.len())
}
