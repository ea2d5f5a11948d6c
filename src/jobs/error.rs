//! Why a call of [`Jobs`](crate::Jobs) fails.
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use thiserror::Error;

use crate::model::{Job, Kind, State};
use railhead_contact::error::CaseError;

/// Why the storage takes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageFault {
    /// No space is left, or a quota is used up.
    Full,
    /// It is read-only, fails, or is locked by another process.
    Unwritable,
    /// Its contents are damaged; that does not pass by itself.
    Damaged,
    /// It is on another machine, and does not answer or takes nothing.
    Unreachable,
}

/// The result of a call on jobs.
pub type Result<T, E = JobsError> = std::result::Result<T, E>;

/// A call of a store failed and changed nothing. Clones share the cause.
#[derive(Debug, Clone, Error)]
pub enum StoreError {
    /// The storage takes nothing at present: wait and repeat the call. No job fails because of it.
    #[error("{1}")]
    Away(StorageFault, Arc<dyn Error + Send + Sync>),
    /// The call failed for another reason: a repetition may help, or the fault is ours.
    #[error("{0}")]
    Failed(Arc<dyn Error + Send + Sync>),
    /// What is stored cannot be read.
    #[error("stored data is damaged: {0}")]
    Corrupt(String),
}

impl StoreError {
    /// The fault of the storage, if that is what it is.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            StoreError::Away(fault, _) => Some(*fault),
            StoreError::Failed(_) | StoreError::Corrupt(_) => None,
        }
    }

    /// Damage was met before.
    #[must_use]
    pub fn damaged() -> StoreError {
        let cause = std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            "the job table is damaged; stop the service and restore a backup",
        );
        StoreError::Away(StorageFault::Damaged, Arc::new(cause))
    }

    /// A writer waits for the storage.
    #[must_use]
    pub fn waited_for(fault: StorageFault) -> StoreError {
        let cause = std::io::Error::other("a write to the storage is repeated until it succeeds");
        StoreError::Away(fault, Arc::new(cause))
    }

    /// The store did not answer in time.
    #[must_use]
    pub fn timed_out() -> StoreError {
        let cause = std::io::Error::from(std::io::ErrorKind::TimedOut);
        StoreError::Away(StorageFault::Unwritable, Arc::new(cause))
    }
}

/// Every way a call of [`Jobs`](crate::Jobs) can fail.
#[derive(Debug, Error)]
pub enum JobsError {
    /// The case cannot be asked; every fault is named.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The queue is full; nothing was stored.
    #[error("{0} jobs are waiting, which is the limit; nothing was stored")]
    QueueFull(u64),
    /// The tenant has as many queued jobs as it may; nothing was stored.
    #[error("{0} jobs of this tenant are waiting, which is its limit; nothing was stored")]
    QuotaExceeded(u64),
    /// What the tenant has stored would take more bytes than it may; nothing was stored.
    #[error(
        "the cases, templates and results of this tenant would take more than the {0} bytes that it may store; delete ended jobs, batches or runs"
    )]
    StoredQuotaExceeded(u64),
    /// The batches of the tenant that are being received are as large as they may be together.
    #[error(
        "the batches of this tenant that are being received take {0} bytes, which is the limit; try again later, or send fewer cases at once"
    )]
    StagingQuotaExceeded(u64),
    /// The batches that are being received are as large as they may be together.
    #[error(
        "the batches that are being received take {0} bytes, which is the limit of the service; try again later"
    )]
    StagingFull(u64),
    /// The name cannot be that of a tenant.
    #[error("the name of a tenant is 1 to 64 letters, digits, dots, dashes and underscores")]
    BadTenant,
    /// The idempotency key was used before with another case, or with other options.
    #[error("this `Idempotency-Key` was used before with a different request")]
    IdempotencyConflict,
    /// There is no work of this kind with this id.
    #[error("no {} has this id", .0.noun())]
    NotFound(Kind),
    /// There was such a job or batch, but its time is over.
    #[error("it ended longer ago than this service keeps ended jobs, so it was removed")]
    Expired,
    /// The work must end first.
    #[error("the {} has not ended; cancel it first, then delete it", .0.noun())]
    NotEnded(Kind),
    /// The key is bound to labels, and this concerns the whole tenant.
    #[error("this key is bound to {labels} and may not {action}; use a key without labels")]
    BoundKey {
        /// The labels of the key.
        labels: String,
        /// What it may not do.
        action: &'static str,
    },
    /// There is no such profile.
    #[error("no profile has this digest")]
    ProfileNotFound,
    /// The tenant keeps as many bytes of profiles as it may.
    #[error(
        "the profiles of this tenant would take more than the {0} bytes that are allowed (`--tenant-profiles-mb`); delete some"
    )]
    ProfilesFull(u64),
    /// The run has more rows than it may.
    #[error("the run has more than the {0} rows that are allowed (`--run-max-rows`)")]
    TooManyRows(u64),
    /// There is no result yet.
    #[error("the job is {}, so there is no result yet", .0.name())]
    NotReady(State),
    /// The job ended without a result; the job says why.
    #[error("{}", without_result(.0))]
    NotSucceeded(Box<Job>),
    /// The patch asked for is not among those with stored fields, of which there are this many; 0 if the case asked for no field.
    #[error("`patch` is too large; allowed: 0 to {}", .0.saturating_sub(1))]
    NoSuchPatch(usize),
    /// The motion asked for is not among those with stored fields, of which there are this many.
    #[error("`point` is too large; allowed: 0 to {}", .0.saturating_sub(1))]
    NoSuchPoint(usize),
    /// The cursor was not made by this service, or for another filter.
    #[error(
        "`cursor` is not one that this service gave out for the same filters; start again without it"
    )]
    BadCursor,
    /// The service is about to stop.
    #[error("the service is shutting down and takes no new jobs")]
    Draining,
    /// Another process uses the data folder.
    #[error("the data folder {} is in use by another process", .0.display())]
    DataDirInUse(PathBuf),
    /// The data folder cannot be used.
    #[error("the data folder {} cannot be used: {source}", path.display())]
    DataDir {
        /// The folder or file in question.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A solver thread could not be started.
    #[error("a solver thread could not be started: {0}")]
    Thread(std::io::Error),
    /// The job table failed.
    #[error("the job table failed: {0}")]
    Store(#[from] StoreError),
    /// The job table is damaged.
    #[error(
        "the job table is damaged ({0}); a copy of a folder in use is not a backup; restore one made by `railhead backup`"
    )]
    TableDamaged(String),
    /// The data folder was written by another version.
    #[error(
        "the job table was written by another version of railhead and this version cannot read it; use a new data folder or \
         database, or that version"
    )]
    UnsupportedSchema,
    /// What names the database is no such name.
    #[error(
        "the database URL cannot be read ({0}); it looks like postgres://user:password@host:5432/database"
    )]
    BadDatabaseUrl(String),
    /// The connection to the database is not encrypted as its URL asks for.
    #[error("the connection to the database is not encrypted as its URL asks for: {0}")]
    NoTls(String),
    /// A data folder with jobs in it cannot be used beside a database.
    #[error("{} holds the jobs of a service without a database; use another --data-dir with --database-url", .0.display())]
    DataDirOfEmbedded(PathBuf),
    /// This program was built without a part that the settings need.
    #[error(
        "this program was built without {what}; `cargo build --release --features {feature}` builds one with it"
    )]
    NotBuilt {
        /// The part.
        what: &'static str,
        /// The feature of Cargo that has it.
        feature: &'static str,
    },
    /// A data folder is moved only into a database without jobs.
    #[error(
        "the database already has jobs or batches; move into one newly created by `railhead migrate`"
    )]
    DatabaseNotEmpty,
    /// There is no job table in the database.
    #[error(
        "there is no job table in the database yet: run `railhead migrate --database-url …` once"
    )]
    NotMigrated,
    /// The job table in the data folder is that of an earlier version, and the service may be using it.
    #[error(
        "the job table in the data folder is from an earlier version: start `railhead serve` of this version with the folder \
         once to upgrade it"
    )]
    OldFolder,
    /// The tables in the database are those of an earlier version.
    #[error(
        "the job table in the database is from an earlier version: run `railhead migrate --database-url …` of this version once"
    )]
    OldTables,
    /// The place of the results cannot be used, or belongs to another database.
    #[error("the location of the results cannot be used: {0}")]
    ResultPlace(String),
    /// Reading or writing a stored result failed.
    #[error("the stored results failed: {0}")]
    Blobs(#[from] object_store::Error),
    /// Something stored cannot be read back.
    #[error("stored data is damaged: {0}")]
    Damaged(String),
}

fn without_result(job: &Job) -> String {
    if job.state == State::Cancelled {
        return "the job was cancelled, so it has no result".to_owned();
    }
    let reason = job.failure.as_ref();
    let reason = reason.map_or("the reason is not known", |failure| &failure.detail);
    format!("the job failed, so it has no result: {reason}")
}
