//! The job table on one machine, embedded: SQLite with one writing connection and a pool of readers.
//!
//! One writer, because SQLite's busy handler has no queue and starves somebody when several connections write; the
//! pool's own queue is fair. `synchronous=FULL`, because a job that was acknowledged must survive a power cut. Every
//! transaction that writes begins with `BEGIN IMMEDIATE`: a deferred one that reads first fails at once when it
//! turns into a writer. The statements keep to what PostgreSQL understands too.
//!
//! Here: opening, and what a client asks for. [`intake`] holds the submission of single jobs, [`claims`] what workers ask
//! for, [`lists`] the lists.

pub mod batches;
pub mod blobs;
pub mod claims;
pub mod deadlines;
pub mod expiry;
pub mod figures;
mod finish;
mod insert;
pub mod intake;
pub mod keys;
pub mod lists;
mod quota;
pub mod reuse;
mod rows;
mod schema;

use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use sqlx::sqlite::{
    SqliteAutoVacuum, SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions,
    SqliteSynchronous,
};
use sqlx::{Connection, Row, SqliteConnection};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::Job;
use crate::jobs::results::Encoded;
use crate::jobs::store::sqlite::blobs::release_blobs;
use crate::jobs::store::sqlite::intake::Intake;
use crate::jobs::store::sqlite::rows::{job_columns, read_blob_id, read_job};
use crate::jobs::store::sqlite::schema::{make_or_require, require};
use crate::jobs::store::{Deleted, Enqueued, StoredResult};

const GET: &str = concat!("SELECT ", job_columns!(), " FROM jobs WHERE id = $1");
/// The write-ahead log is cut to this size when it was larger for a while.
const LOG_BYTES: &str = "67108864";
const READERS: u32 = 4;
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// The embedded job table.
#[derive(Debug, Clone)]
pub struct SqliteStore {
    file: PathBuf,
    writer: SqlitePool,
    readers: SqlitePool,
    intake: Intake,
}

impl SqliteStore {
    /// Opens the database file; makes it if there is none.
    ///
    /// # Errors
    /// The file cannot be opened, or [`JobsError::OtherForm`].
    pub async fn open(file: &Path) -> Result<SqliteStore, JobsError> {
        make_private(file)?;
        let store = SqliteStore::connect(file).await?;
        make_or_require(&store.writer).await?;
        Ok(store)
    }

    /// Opens the database file beside a service that may be using it; makes and changes nothing.
    ///
    /// # Errors
    /// There is no such file, it cannot be opened, or [`JobsError::OtherForm`].
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
        let writer = pool(1)
            .before_acquire(|connection, _| Box::pin(is_free(connection)))
            .connect_with(writing)
            .await?;
        let readers = pool(READERS).connect_with(options.read_only(true)).await?;
        Ok(SqliteStore {
            file: file.to_owned(),
            intake: Intake::start(writer.clone()),
            writer,
            readers,
        })
    }

    /// Closes every connection; the write-ahead log is folded into the database.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }

    /// Looks through the whole file for damage.
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

    /// A round trip to the database.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn ping(&self) -> Result<(), JobsError> {
        sqlx::query("SELECT 1 FROM jobs LIMIT 1")
            .fetch_optional(&self.readers)
            .await?;
        Ok(())
    }

    /// Writes a copy of the database, as it is at one moment, to a new file that nobody else may read.
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

    /// Writes a page that is as it was.
    ///
    /// # Errors
    /// The database cannot be written.
    pub async fn touch(&self) -> Result<(), JobsError> {
        schema::mark(&self.writer).await
    }

    /// What an idempotency key of a tenant stands for, if it was used.
    ///
    /// # Errors
    /// The database failed.
    pub async fn by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, JobsError> {
        let mut connection = self.readers.acquire().await?;
        intake::by_key(&mut connection, tenant, key, digest).await
    }

    /// Cancels a queued job at once and asks the worker of a running one to stop; an ended job stays as it is.
    /// Returns the job as it then is, `None` if there is none.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn cancel(&self, id: Uuid, now: i64) -> Result<Option<Job>, JobsError> {
        let row = sqlx::query(concat!(
            "UPDATE jobs SET state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
             ended_at = CASE WHEN state = 'queued' THEN $1 ELSE NULL END, \
             cancel_requested = 1, version = version + 1 \
             WHERE id = $2 AND cancel_requested = 0 AND state IN ('queued', 'running') RETURNING ",
            job_columns!()
        ))
        .bind(now)
        .bind(id.to_string())
        .fetch_optional(&self.writer)
        .await?;
        match row {
            Some(row) => read_job(&row).map(Some),
            None => self.get(id).await,
        }
    }

    /// Removes an ended job with its case, labels and idempotency key.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn delete(&self, id: Uuid) -> Result<Deleted, JobsError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let gone = sqlx::query(
            "DELETE FROM jobs WHERE id = $1 AND state IN ('succeeded', 'failed', 'cancelled') RETURNING blob_id",
        )
        .bind(id.to_string())
        .fetch_optional(&mut *transaction)
        .await?;
        if let Some(row) = gone {
            release_blobs(&mut transaction, read_blob_id(&row)?.into_iter().collect()).await?;
            transaction.commit().await?;
            return Ok(Deleted::Done);
        }
        drop(transaction);
        let job = self.get(id).await?;
        Ok(job.map_or(Deleted::NotFound, |job| Deleted::NotEnded(job.state)))
    }

    /// Looks at one job.
    ///
    /// # Errors
    /// The database failed.
    pub async fn get(&self, id: Uuid) -> Result<Option<Job>, JobsError> {
        let row = sqlx::query(GET)
            .bind(id.to_string())
            .fetch_optional(&self.readers)
            .await?;
        row.as_ref().map(read_job).transpose()
    }

    /// The result of a job that lies in the database: its solution and its fields.
    ///
    /// # Errors
    /// The database failed.
    pub async fn small_result(&self, id: Uuid) -> Result<Option<Encoded>, JobsError> {
        let row = sqlx::query(
            "SELECT solution, fields FROM jobs JOIN blobs ON blobs.id = jobs.blob_id \
             WHERE jobs.id = $1 AND key IS NULL",
        )
        .bind(id.to_string())
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let solution: Vec<u8> = row.try_get("solution")?;
        let fields: Option<Vec<u8>> = row.try_get("fields")?;
        Ok(Some(Encoded {
            solution: solution.into(),
            fields: fields.map(Into::into),
        }))
    }

    /// A job with the place of its result, if it has one.
    ///
    /// # Errors
    /// The database failed.
    pub async fn result(&self, id: Uuid) -> Result<Option<(Job, Option<StoredResult>)>, JobsError> {
        let row = sqlx::query(concat!(
            "SELECT ",
            job_columns!(),
            ", blob_id, field_patches, outputs, (SELECT key FROM blobs WHERE blobs.id = blob_id) AS key \
             FROM jobs WHERE id = $1"
        ))
        .bind(id.to_string())
        .fetch_optional(&self.readers)
        .await?;
        let Some(row) = row else { return Ok(None) };
        let patches: u32 = row.try_get("field_patches")?;
        let stored = match read_blob_id(&row)? {
            None => None,
            Some(_) => Some(StoredResult {
                job: id,
                key: row.try_get("key")?,
                field_patches: patches as usize,
                outputs: row.try_get("outputs")?,
            }),
        };
        Ok(Some((read_job(&row)?, stored)))
    }
}

/// Makes an empty file that nobody else may read, if there is none; what SQLite puts beside it gets the same mode.
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
