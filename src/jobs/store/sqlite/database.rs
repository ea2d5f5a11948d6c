//! The embedded job table: SQLite with one writing connection and a pool of readers.
//!
//! There is one writing connection, because several writers would starve each other: SQLite's busy handler has no queue,
//! while the pool is fair. `synchronous=FULL`, because an acknowledged job must survive a power cut; claims need not. Every
//! write transaction begins with `BEGIN IMMEDIATE`, because a deferred one that reads first fails when it begins to write.
//!
//! The schema is created in an empty file, and migrated from earlier versions. Other files are refused and not changed.
//! `schema.sql` is the oldest supported version. Every later version is a migration, which is one transaction: after a
//! crash between two migrations, the next start continues.

use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::OpenFlags;

use crate::error::JobsError;
use crate::store::Result;
use crate::store::sqlite::connection::{Connection, Pool, query, query_scalar};
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

    /// The keys of all referenced large results.
    pub(crate) async fn large_results(&self) -> Result<Vec<String>> {
        let keys = query_scalar("SELECT DISTINCT key FROM blobs WHERE key IS NOT NULL");
        keys.fetch_all(&self.readers).await
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

/// The statements that create the tables of the oldest supported version.
const SCHEMA: &str = include_str!("schema.sql");

/// Marks a file as a job table of this service ("rhjb").
const APPLICATION: i64 = 0x7268_6a62;

/// The version of `schema.sql`.
const FIRST_SCHEMA_VERSION: i64 = 7;

/// Migrations, in order: the version after the migration, and its statements. A released migration is never changed.
const STEPS: &[(i64, &str)] = &[
    (8, include_str!("steps/8.sql")),
    (9, include_str!("steps/9.sql")),
    (10, include_str!("steps/10.sql")),
    (11, include_str!("steps/11.sql")),
];

/// The version that this program reads and writes.
const SCHEMA_VERSION: i64 = STEPS[STEPS.len() - 1].0;

/// Creates the tables in an empty file, or migrates them to the version of this program.
///
/// # Errors
/// [`JobsError::UnsupportedSchema`] if the file holds something else or is of a later version, or the database failed.
pub(crate) async fn migrate(writer: &Pool) -> Result<(), JobsError> {
    loop {
        let mut transaction = writer.begin().await?;
        let tables: i64 = sql!(scalar fetch_one, &mut *transaction,
            "SELECT COUNT(*) FROM sqlite_schema"
        )?;
        let step = match tables {
            0 => Some(&(FIRST_SCHEMA_VERSION, SCHEMA)),
            _ => match form(&mut transaction).await? {
                SCHEMA_VERSION => return Ok(()),
                form => STEPS.iter().find(|(reached, _)| *reached == form + 1),
            },
        };
        let (reached, statements) = *step.ok_or(JobsError::UnsupportedSchema)?;
        transaction.batch(statements)?;
        transaction.batch(&format!(
            "PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {reached}"
        ))?;
        transaction.commit().await?;
        tracing::debug!(form = reached, "the job table has a new form");
    }
}

/// Requires that a file is a job table of this version; changes nothing.
///
/// # Errors
/// [`JobsError::OldFolder`], [`JobsError::UnsupportedSchema`], or the database failed.
pub(crate) async fn require(pool: &Pool) -> Result<(), JobsError> {
    match form(&mut *pool.acquire().await?).await? {
        SCHEMA_VERSION => Ok(()),
        FIRST_SCHEMA_VERSION..SCHEMA_VERSION => Err(JobsError::OldFolder),
        _ => Err(JobsError::UnsupportedSchema),
    }
}

/// The version of the tables.
async fn form(connection: &mut Connection) -> Result<i64, JobsError> {
    let application: i64 = sql!(scalar fetch_one, &mut *connection, "PRAGMA application_id")?;
    if application != APPLICATION {
        return Err(JobsError::UnsupportedSchema);
    }
    let form = query_scalar("PRAGMA user_version");
    Ok(form.fetch_one(connection).await?)
}

/// Writes the version again, which does not change it.
pub(crate) async fn mark(writer: &Pool) -> Result<()> {
    sql!(
        execute,
        writer,
        format!("PRAGMA user_version = {SCHEMA_VERSION}")
    )?;
    Ok(())
}

#[cfg(test)]
mod schema_tests {
    use crate::store::Store;
    use crate::store::sqlite::database::SqliteStore;

    fn write(file: &std::path::Path, statement: &str) {
        let connection = rusqlite::Connection::open(file).unwrap();
        connection.execute_batch(statement).unwrap();
    }

    #[tokio::test]
    async fn a_table_of_another_version_is_refused_and_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let old = folder.path().join("old.db");
        write(&old, "CREATE TABLE jobs (id TEXT); PRAGMA user_version = 1");
        let newer = folder.path().join("newer.db");
        SqliteStore::open(&newer).await.unwrap().close().await;
        write(&newer, "PRAGMA user_version = 1000");
        for file in [&old, &newer] {
            for opened in [
                SqliteStore::open(file).await,
                SqliteStore::open_existing(file).await,
            ] {
                let error = opened.expect_err("it is of another form").to_string();
                assert!(error.contains("another version of railhead"), "{error}");
            }
        }
        write(&old, "INSERT INTO jobs VALUES ('still there')");
    }

    #[tokio::test]
    async fn beside_a_service_nothing_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        assert!(SqliteStore::open_existing(&file).await.is_err());
        assert!(!file.exists());
        SqliteStore::open(&file).await.unwrap().close().await;
        SqliteStore::open_existing(&file).await.unwrap();
    }

    #[tokio::test]
    async fn the_table_is_for_nobody_else_to_read() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let _open = SqliteStore::open(&file).await.unwrap();
        for entry in std::fs::read_dir(folder.path()).unwrap() {
            let entry = entry.unwrap();
            let mode = entry.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{:?}", entry.file_name());
        }
    }
}
