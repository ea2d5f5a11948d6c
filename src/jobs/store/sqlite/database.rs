//! The embedded job table: SQLite with one writing connection and a pool of readers.
//!
//! There is one writing connection, because several writers would starve each other: SQLite's busy handler has no queue,
//! while the pool is fair. `synchronous=FULL`, because an acknowledged job must survive a power cut; claims need not. Every
//! write transaction begins with `BEGIN IMMEDIATE`, because a deferred one that reads first fails when it begins to write.

use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::OpenFlags;

use crate::error::JobsError;
use crate::store::Result;
use crate::store::sqlite::connection::{Pool, query, query_scalar};
use crate::store::sqlite::schema::{migrate, require};
use crate::store::sqlite::sql::submit::GroupCommit;

/// The write-ahead log is truncated to this size.
const LOG_BYTES: i64 = 64 << 20;

const READERS: u32 = 4;

/// How long opening waits for another process that opens the same file. Statements wait without a thread, see [`Pool`].
const OPEN_TIMEOUT: Duration = Duration::from_secs(10);

/// The embedded job table.
#[derive(Debug, Clone)]
pub struct SqliteStore {
    pub(crate) file: PathBuf,
    pub(crate) writer: Pool,
    pub(crate) readers: Pool,
    pub(crate) group_commit: GroupCommit,
}

impl SqliteStore {
    /// Opens the database file; creates it if it does not exist, and upgrades one of an earlier version.
    ///
    /// # Errors
    /// The file cannot be opened, or [`JobsError::UnsupportedSchema`].
    pub async fn open(file: &Path) -> Result<SqliteStore, JobsError> {
        make_private(file)?;
        let store = SqliteStore::connect(file)?;
        migrate(&store.writer).await?;
        Ok(store)
    }

    /// Opens the database file, which a service may be using; changes nothing.
    ///
    /// # Errors
    /// The file does not exist, cannot be opened, [`JobsError::OldFolder`] or [`JobsError::UnsupportedSchema`].
    pub async fn open_existing(file: &Path) -> Result<SqliteStore, JobsError> {
        std::fs::metadata(file).map_err(JobsError::at(file))?;
        let store = SqliteStore::connect(file)?;
        require(&store.readers).await?;
        Ok(store)
    }

    fn connect(file: &Path) -> Result<SqliteStore> {
        let path = file.to_owned();
        let writer = Pool::open(1, Box::new(move || open_writer(&path)))?;
        let path = file.to_owned();
        let readers = Pool::open(READERS, Box::new(move || open_reader(&path)))?;
        Ok(SqliteStore {
            file: file.to_owned(),
            group_commit: GroupCommit::start(writer.clone())?,
            writer,
            readers,
        })
    }

    /// Checks the whole file for damage.
    ///
    /// # Errors
    /// [`JobsError::TableDamaged`], or the database failed.
    pub async fn check(&self) -> Result<(), JobsError> {
        let found: String = sql!(scalar fetch_one, &self.readers, "PRAGMA quick_check(1)")?;
        match found.as_str() {
            "ok" => Ok(()),
            _ => Err(JobsError::TableDamaged(found)),
        }
    }

    /// Writes a snapshot of the database to a new file with mode 0600.
    ///
    /// # Errors
    /// The file exists or cannot be written.
    pub async fn copy_into(&self, file: &Path) -> Result<(), JobsError> {
        make_private(file)?;
        sql!(execute, &self.writer, "VACUUM INTO $1"; file.to_string_lossy())?;
        Ok(())
    }
}

/// Creates an empty file with mode 0600, if it does not exist; SQLite gives its other files the same mode.
fn make_private(file: &Path) -> Result<(), JobsError> {
    let made = std::fs::OpenOptions::new()
        .create_new(true)
        .write(true)
        .mode(0o600)
        .open(file);
    match made {
        Err(source) if source.kind() != std::io::ErrorKind::AlreadyExists => {
            Err(JobsError::at(file)(source))
        }
        _ => Ok(()),
    }
}

fn open_writer(file: &Path) -> rusqlite::Result<rusqlite::Connection> {
    let empty = std::fs::metadata(file).is_ok_and(|about| about.len() == 0);
    let connection = open(file, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
    // The mode is stored in the file. Setting it again writes a page, which fails on a full disk.
    if empty {
        connection.execute_batch("PRAGMA auto_vacuum = INCREMENTAL")?;
    }
    connection.execute_batch(&format!(
        "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA journal_size_limit = {LOG_BYTES}; PRAGMA foreign_keys = ON"
    ))?;
    connection.busy_timeout(Duration::ZERO)?;
    Ok(connection)
}

fn open_reader(file: &Path) -> rusqlite::Result<rusqlite::Connection> {
    let connection = open(file, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    connection.busy_timeout(Duration::ZERO)?;
    Ok(connection)
}

fn open(file: &Path, mode: OpenFlags) -> rusqlite::Result<rusqlite::Connection> {
    // Each connection is used by one thread at a time.
    let flags = mode | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = rusqlite::Connection::open_with_flags(file, flags)?;
    connection.busy_timeout(OPEN_TIMEOUT)?;
    Ok(connection)
}
