//! Errors of [`Jobs`](crate::Jobs) and of stores.
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use crate::model::{Job, Kind, State};
use railhead_contact::error::CaseError;

/// Why storage rejects writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageFault {
    /// No space is left, or a quota is used up.
    Full,
    /// It is read-only, faulty, or locked by another process.
    Unwritable,
    /// Its contents are damaged, which requires a restore.
    Damaged,
    /// It is on another machine that is unreachable or rejects writes.
    Unreachable,
}

/// The result of a call on jobs.
pub type Result<T, E = JobsError> = std::result::Result<T, E>;

/// A failed call of a store, which changed nothing. Clones share the cause.
#[derive(Debug, Clone, Error)]
pub enum StoreError {
    /// Storage rejects writes at present; the call can be repeated later. Jobs do not fail because of it.
    #[error("{1}")]
    Away(StorageFault, Arc<dyn Error + Send + Sync>),
    /// Another failure, such as a conflict or an internal error.
    #[error("{0}")]
    Failed(Arc<dyn Error + Send + Sync>),
    /// Stored data cannot be read.
    #[error("stored data is damaged: {0}")]
    Corrupt(String),
}

impl StoreError {
    /// The fault of the storage, if it is the cause.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            StoreError::Away(fault, _) => Some(*fault),
            StoreError::Failed(_) | StoreError::Corrupt(_) => None,
        }
    }

    /// The error while storage rejects writes for this reason.
    #[must_use]
    pub fn away(fault: StorageFault, reason: &'static str) -> StoreError {
        StoreError::Away(
            fault,
            Arc::from(Box::<dyn Error + Send + Sync>::from(reason)),
        )
    }

    /// The error for a store that did not answer in time.
    #[must_use]
    pub fn timed_out() -> StoreError {
        let cause = std::io::Error::from(std::io::ErrorKind::TimedOut);
        StoreError::Away(StorageFault::Unwritable, Arc::new(cause))
    }
}

/// Errors of [`Jobs`](crate::Jobs).
#[derive(Debug, Error)]
pub enum JobsError {
    /// The case is invalid; contains every fault.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The queue is full; nothing was stored.
    #[error("{0} jobs are waiting, which is the limit; nothing was stored")]
    QueueFull(u64),
    /// The bound of queued jobs of the tenant is reached; nothing was stored.
    #[error("{0} jobs of this tenant are waiting, which is its limit; nothing was stored")]
    QuotaExceeded(u64),
    /// The bound of stored bytes of the tenant would be exceeded; nothing was stored.
    #[error(
        "the cases, templates and results of this tenant would take more than the {0} bytes that it may store; delete ended jobs, batches or runs"
    )]
    StoredQuotaExceeded(u64),
    /// The bound of staged bytes of the tenant is reached.
    #[error(
        "the batches of this tenant that are being received take {0} bytes, which is the limit; try again later, or send fewer cases at once"
    )]
    StagingQuotaExceeded(u64),
    /// The bound of staged bytes is reached.
    #[error(
        "the batches that are being received take {0} bytes, which is the limit of the service; try again later"
    )]
    StagingFull(u64),
    /// The name of a tenant is invalid.
    #[error("the name of a tenant is 1 to 64 letters, digits, dots, dashes and underscores")]
    BadTenant,
    /// The idempotency key was used before with another case, or with other options.
    #[error("this `Idempotency-Key` was used before with a different request")]
    IdempotencyConflict,
    /// No work of this kind has this id.
    #[error("no {} has this id", .0.noun())]
    NotFound(Kind),
    /// The work has expired and was removed.
    #[error("it ended longer ago than this service keeps ended jobs, so it was removed")]
    Expired,
    /// The work has not ended.
    #[error("the {} has not ended; cancel it first, then delete it", .0.noun())]
    NotEnded(Kind),
    /// The key is restricted by labels, and the action concerns the whole tenant.
    #[error("this key is bound to {labels} and may not {action}; use a key without labels")]
    BoundKey {
        /// The labels of the key.
        labels: String,
        /// The rejected action.
        action: &'static str,
    },
    /// No profile has this digest.
    #[error("no profile has this digest")]
    ProfileNotFound,
    /// The bound of the stored profiles of the tenant would be exceeded.
    #[error(
        "the profiles of this tenant would take more than the {0} bytes that are allowed (`--tenant-profiles-mb`); delete some"
    )]
    ProfilesFull(u64),
    /// The run has too many rows.
    #[error("the run has more than the {0} rows that are allowed (`--run-max-rows`)")]
    TooManyRows(u64),
    /// The job has not ended.
    #[error("the job is {}, so there is no result yet", .0.name())]
    NotReady(State),
    /// The job ended without a result.
    #[error("{}", without_result(.0))]
    NotSucceeded(Box<Job>),
    /// The requested patch does not exist; contains the number of patches with stored fields, 0 without fields.
    #[error("there are {0} patches with fields")]
    NoSuchPatch(usize),
    /// The requested motion does not exist; contains the number of motions with stored fields.
    #[error("there are {0} motions with fields")]
    NoSuchPoint(usize),
    /// The cursor is invalid or belongs to another filter.
    #[error("`cursor` belongs to other filters or is damaged; start again without it")]
    BadCursor,
    /// The service is stopping.
    #[error("the service is shutting down and takes no new jobs")]
    Draining,
    /// Another process uses the data folder.
    #[error("the data folder {} is in use by another process", .0.display())]
    DataDirInUse(PathBuf),
    /// The data folder cannot be used.
    #[error("`{}` cannot be used: {source}", path.display())]
    DataDir {
        /// The folder or file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A solver thread could not be started.
    #[error("a solver thread could not be started: {0}")]
    Thread(std::io::Error),
    /// A call of the job table failed.
    #[error("the job table failed: {0}")]
    Store(#[from] StoreError),
    /// The job table is damaged.
    #[error(
        "the job table is damaged ({0}); a copy of a folder in use is not a backup; restore one made by `railhead backup`"
    )]
    TableDamaged(String),
    /// The job table has another version.
    #[error(
        "the job table was written by another version of railhead and this version cannot read it; use a new data folder or \
         database, or that version"
    )]
    UnsupportedSchema,
    /// The database URL is invalid.
    #[error(
        "the database URL cannot be read ({0}); it looks like postgres://user:password@host:5432/database"
    )]
    BadDatabaseUrl(String),
    /// The connection to the database is not encrypted as its URL requires.
    #[error("the connection to the database is not encrypted as its URL asks for: {0}")]
    NoTls(String),
    /// A data folder with a job table cannot be used with a database.
    #[error("{} holds the jobs of a service without a database; use another --data-dir with --database-url", .0.display())]
    DataDirOfEmbedded(PathBuf),
    /// The settings require a feature that this build lacks.
    #[error(
        "this program was built without {what}; `cargo build --release --features {feature}` builds one with it"
    )]
    NotBuilt {
        /// Name of the feature.
        what: &'static str,
        /// The Cargo feature.
        feature: &'static str,
    },
    /// The database for a move contains jobs or batches.
    #[error(
        "the database already has jobs or batches; move into one newly created by `railhead migrate`"
    )]
    DatabaseNotEmpty,
    /// The database has no job table.
    #[error(
        "there is no job table in the database yet: run `railhead migrate --database-url …` once"
    )]
    NotMigrated,
    /// The job table in the data folder has an earlier version, and a service may be using it.
    #[error(
        "the job table in the data folder is from an earlier version: start `railhead serve` of this version with the folder \
         once to upgrade it"
    )]
    OldFolder,
    /// The tables in the database have an earlier version.
    #[error(
        "the job table in the database is from an earlier version: run `railhead migrate --database-url …` of this version once"
    )]
    OldTables,
    /// The location of the results cannot be used, or belongs to another database.
    #[error("the location of the results cannot be used: {0}")]
    ResultPlace(String),
    /// A read or write of a stored result failed.
    #[error("the stored results failed: {0}")]
    Blobs(#[from] object_store::Error),
    /// Stored data cannot be read.
    #[error("stored data is damaged: {0}")]
    Damaged(String),
}

impl JobsError {
    /// Converts an I/O error of a file or folder.
    pub(crate) fn at(path: &Path) -> impl Fn(std::io::Error) -> JobsError + use<> {
        let path = path.to_owned();
        move |source| JobsError::DataDir {
            path: path.clone(),
            source,
        }
    }
}

fn without_result(job: &Job) -> String {
    if job.state == State::Cancelled {
        return "the job was cancelled, so it has no result".to_owned();
    }
    let reason = job.failure.as_ref();
    let reason = reason.map_or("the reason is not known", |failure| &failure.detail);
    format!("the job failed, so it has no result: {reason}")
}
