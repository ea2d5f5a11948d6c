//! The job table on one machine, embedded: SQLite with one writing connection and a pool of readers.
//!
//! There is one writing connection, because SQLite's busy handler has no queue: of several writers one starves. The queue of
//! the pool is fair. `synchronous=FULL`, because a job that was acknowledged must survive a power cut. Every
//! transaction that writes begins with `BEGIN IMMEDIATE`: a deferred one that reads first fails at once when it
//! turns into a writer.

use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use sqlx::sqlite::{
    SqliteAutoVacuum, SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions,
    SqliteSynchronous,
};
use sqlx::{Connection, SqliteConnection};

use crate::jobs::error::JobsError;
use crate::jobs::store::sqlite::schema::{mark, migrate, require};
use crate::jobs::store::sqlite::sql::group_commit::GroupCommit;
use crate::jobs::store::sqlite::statements::Writer;
use crate::jobs::store_error::StoreError;

/// The write-ahead log is cut to this size when it was larger for a while.
const LOG_BYTES: &str = "67108864";

const READERS: u32 = 4;

const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// The embedded job table.
#[derive(Debug, Clone)]
pub struct SqliteStore {
    pub(crate) file: PathBuf,
    pub(crate) writer: SqlitePool,
    pub(crate) readers: SqlitePool,
    pub(crate) group_commit: GroupCommit,
    /// A transaction of the writing connection was begun and its end is not known.
    pub(crate) interrupted: Arc<AtomicBool>,
}

impl SqliteStore {
    /// Opens the database file; makes it if there is none, and brings it forward if an earlier version made it.
    ///
    /// # Errors
    /// The file cannot be opened, or [`JobsError::OtherForm`].
    pub async fn open(file: &Path) -> Result<SqliteStore, JobsError> {
        make_private(file)?;
        let store = SqliteStore::connect(file).await?;
        migrate(&store.writer).await?;
        Ok(store)
    }

    /// Opens the database file beside a service that may be using it; makes and changes nothing.
    ///
    /// # Errors
    /// There is no such file, it cannot be opened, [`JobsError::OldFolder`] or [`JobsError::OtherForm`].
    pub async fn open_existing(file: &Path) -> Result<SqliteStore, JobsError> {
        std::fs::metadata(file).map_err(|source| JobsError::DataDir {
            path: file.to_owned(),
            source,
        })?;
        let store = SqliteStore::connect(file).await?;
        require(&store.readers).await?;
        Ok(store)
    }

    async fn connect(file: &Path) -> Result<SqliteStore, JobsError> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .pragma("journal_size_limit", LOG_BYTES)
            .busy_timeout(BUSY_TIMEOUT)
            .foreign_keys(true);
        let pool = |connections: u32| {
            SqlitePoolOptions::new()
                .max_connections(connections)
                .idle_timeout(None)
                .max_lifetime(None)
                .test_before_acquire(false)
        };
        let mut writing = options.clone();
        // The mode stays with the file. Setting it again writes a page, which a full disk does not take.
        if std::fs::metadata(file).is_ok_and(|about| about.len() == 0) {
            writing = writing.auto_vacuum(SqliteAutoVacuum::Incremental);
        }
        let interrupted = Arc::new(AtomicBool::new(false));
        let open = interrupted.clone();
        let writer = pool(1)
            .before_acquire(move |connection, _| {
                let interrupted = open.swap(false, Ordering::AcqRel);
                Box::pin(async move { Ok(!interrupted && is_free(connection).await?) })
            })
            .connect_with(writing)
            .await?;
        let readers = pool(READERS).connect_with(options.read_only(true)).await?;
        Ok(SqliteStore {
            file: file.to_owned(),
            group_commit: GroupCommit::start(Writer {
                pool: writer.clone(),
                interrupted: interrupted.clone(),
            }),
            writer,
            readers,
            interrupted,
        })
    }

    /// Closes every connection; the write-ahead log is folded into the database.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }

    /// Checks the whole file for damage.
    ///
    /// # Errors
    /// [`JobsError::TableDamaged`], or the database failed.
    pub async fn check(&self) -> Result<(), JobsError> {
        let found: String = sqlx::query_scalar("PRAGMA quick_check(1)")
            .fetch_one(&self.readers)
            .await?;
        match found.as_str() {
            "ok" => Ok(()),
            _ => Err(JobsError::TableDamaged(found)),
        }
    }

    /// Writes a copy of the database, as it is at one moment, to a new file with mode 0600.
    ///
    /// # Errors
    /// The file is there already or cannot be written.
    pub async fn copy_into(&self, file: &Path) -> Result<(), JobsError> {
        make_private(file)?;
        sqlx::query("VACUUM INTO $1")
            .bind(file.to_string_lossy().into_owned())
            .execute(&self.writer)
            .await?;
        Ok(())
    }

    /// A round trip; with `write` it writes a page that stays as it was.
    pub(crate) async fn ready(&self, write: bool) -> Result<(), StoreError> {
        if write {
            return Ok(mark(&self.writer).await?);
        }
        sqlx::query("SELECT 1 FROM jobs LIMIT 1")
            .fetch_optional(&self.readers)
            .await?;
        Ok(())
    }
}

/// Makes an empty file with mode 0600, if there is none; what SQLite puts beside it gets the same mode.
fn make_private(file: &Path) -> Result<(), JobsError> {
    let made = std::fs::OpenOptions::new()
        .create_new(true)
        .write(true)
        .mode(0o600)
        .open(file);
    match made {
        Err(source) if source.kind() != std::io::ErrorKind::AlreadyExists => {
            Err(JobsError::DataDir {
                path: file.to_owned(),
                source,
            })
        }
        _ => Ok(()),
    }
}

/// A transaction that a full disk broke can leave its connection inside it for ever; such a connection is replaced.
async fn is_free(connection: &mut SqliteConnection) -> sqlx::Result<bool> {
    if connection.is_in_transaction() {
        // A rollback may be on its way; it is done after a round trip.
        connection.ping().await?;
    }
    Ok(!connection.is_in_transaction())
}
