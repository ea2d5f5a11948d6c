//! How jobs are kept and worked on.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use crate::contact::case::solver::Limits;
use crate::jobs::clock::Clock;
use crate::jobs::result_place::url::ResultsPlace;
use crate::jobs::staged_bytes::StagingBounds;
use crate::jobs::trace::Tracer;

pub use crate::jobs::store::cluster::NotifyMode;

/// A database that several processes share.
#[derive(Clone, PartialEq, Eq)]
pub struct Database {
    /// `postgres://user:password@host:port/database`.
    pub url: String,
    /// Most connections of this process, beside the one on which it listens.
    pub connections: u32,
    /// Where nodes receive each other's notifications.
    pub notify_mode: NotifyMode,
}

impl fmt::Debug for Database {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The URL has a password in it.
        write!(f, "Database({} connections)", self.connections)
    }
}

/// How jobs are kept and worked on.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the job table and the results; created if it is not there.
    pub data_dir: PathBuf,
    /// The database that keeps jobs and results, if several processes share them; otherwise they are in the data folder.
    pub database: Option<Database>,
    /// Where large results are kept, if neither in the data folder nor in the database.
    pub results: Option<ResultsPlace>,
    /// Number of workers, each with a solver thread of its own.
    pub workers: usize,
    /// What one case may use.
    pub limits: Limits,
    /// How long a worker may go without a heartbeat before its job is given to another.
    pub lease: Duration,
    /// Longest solver time of a case, also of one that names no `time_limit_s`.
    pub time_limit: Duration,
    /// Solver time after which a solve makes room for others that wait.
    pub slice: Duration,
    /// Solver threads that do not stop beyond which the process ends, for whoever supervises it to start it again.
    pub abandoned_max: usize,
    /// Attempts at a job before it fails as `worker_lost`.
    pub attempts_max: u32,
    /// Bound of queued jobs.
    pub queue_max: u64,
    /// Bound of queued jobs of one tenant.
    pub tenant_queue_max: u64,
    /// Bytes of cross-sections that a tenant may keep.
    pub tenant_profiles_max_bytes: u64,
    /// Bytes of cases, templates and results that a tenant may have stored before its submissions are refused, if they are bounded.
    pub tenant_stored_max_bytes: Option<u64>,
    /// Bounds of what batches that are being received stand for.
    pub staging: StagingBounds,
    /// Most jobs a worker claims together, if they are small; 1 means no groups.
    pub group_max: usize,
    /// Results up to this size in bytes are kept in the database, larger ones in folders.
    pub small_result_max_bytes: usize,
    /// Identical cases get the result of the first one that was solved.
    pub cache: bool,
    /// How long ended jobs are kept; `None`: until they are deleted.
    pub retention: Option<Duration>,
    /// What leases, ends and expiries are measured with.
    pub clock: Clock,
    /// What makes spans of jobs, if they are collected.
    pub tracer: Option<Tracer>,
}

impl Options {
    /// The defaults for a data folder: one worker, a lease of 30 s, a day of solver time, slices of 2 s,
    /// 3 abandoned threads, 5 attempts, 300 000 queued jobs of which
    /// 250 000 of one tenant, 16 GiB of batches being received of which 4 GiB of one tenant,
    /// groups of 256, results up to 32 KiB in the database, results used again,
    /// ended jobs kept for ever, the system's clock, no spans.
    #[must_use]
    pub fn new(data_dir: impl Into<PathBuf>) -> Options {
        Options {
            data_dir: data_dir.into(),
            database: None,
            results: None,
            workers: 1,
            limits: Limits::default(),
            lease: Duration::from_secs(30),
            time_limit: Duration::from_secs(24 * 3600),
            slice: Duration::from_secs(2),
            abandoned_max: 3,
            attempts_max: 5,
            queue_max: 300_000,
            tenant_queue_max: 250_000,
            tenant_profiles_max_bytes: 64 << 20,
            tenant_stored_max_bytes: None,
            staging: StagingBounds {
                all: 16 << 30,
                tenant: 4 << 30,
            },
            group_max: 256,
            small_result_max_bytes: 32 << 10,
            cache: true,
            retention: None,
            clock: Clock::system(),
            tracer: None,
        }
    }
}
