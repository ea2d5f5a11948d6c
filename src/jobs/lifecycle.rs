//! How the jobs room is opened, started and stopped.

use std::fs::{DirBuilder, File, TryLockError};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::available_parallelism;
use std::time::Duration;

use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::contact::case::limits::Limits;
use crate::jobs::clock::Clock;
use crate::jobs::error::JobsError;
use crate::jobs::keys::ANONYMOUS;
use crate::jobs::leaps::Leaps;
use crate::jobs::metrics::Metrics;
use crate::jobs::recent::RecentLooks;
use crate::jobs::recipe::Recipe;
use crate::jobs::results::Results;
use crate::jobs::staging::{Staged, StagingBounds};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::trace::Tracer;
use crate::jobs::turns::Turns;
use crate::jobs::underway::Underway;
use crate::jobs::worker::Worker;
use crate::jobs::{Jobs, Shared, housekeeping, reserve, retention, wishes};

/// The file that says that the job table was closed in good order.
const CLOSED: &str = "closed";
/// How long a shutdown waits for workers that were told to stop, beyond their own patience.
const STOPPED_WITHIN: Duration = Duration::from_secs(10);

/// How jobs are kept and worked on.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the job table and the results; created if it is not there.
    pub data_dir: PathBuf,
    /// Number of workers, each with a solver thread of its own.
    pub workers: usize,
    /// What one case may use.
    pub limits: Limits,
    /// How long a worker may be silent before its job is given away.
    pub lease: Duration,
    /// Longest solver time of a case, also of one that names no `time_limit_s`.
    pub time_limit: Duration,
    /// Solver time after which a solve makes room for others that wait.
    pub slice: Duration,
    /// Most solves that wait for their next turn.
    pub parked_max: usize,
    /// Most memory in bytes that they are estimated to hold together.
    pub parked_bytes_max: u64,
    /// Solver threads that do not stop beyond which the process ends, for whoever supervises it to start it again.
    pub abandoned_max: usize,
    /// Attempts at a job before it fails as `worker_lost`.
    pub attempts_max: u32,
    /// Bound of queued jobs.
    pub queue_max: u64,
    /// Bound of queued jobs of one tenant.
    pub tenant_queue_max: u64,
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
    /// What makes spans of jobs, if somebody collects them.
    pub tracer: Option<Tracer>,
}

impl Options {
    /// The defaults for a data folder: one worker, a lease of 30 s, a day of solver time, slices of 2 s, 4 solves of 4 GiB that
    /// wait for a turn, 3 abandoned threads, 5 attempts, 300 000 queued jobs of which
    /// 250 000 of one tenant, 16 GiB of batches being received of which 4 GiB of one tenant,
    /// groups of 256, results up to 32 KiB in the database, results used again,
    /// ended jobs kept for ever, the system's clock, no spans.
    #[must_use]
    pub fn new(data_dir: impl Into<PathBuf>) -> Options {
        Options {
            data_dir: data_dir.into(),
            workers: 1,
            limits: Limits::default(),
            lease: Duration::from_secs(30),
            time_limit: Duration::from_secs(24 * 3600),
            slice: Duration::from_secs(2),
            parked_max: 4,
            parked_bytes_max: 4 << 30,
            abandoned_max: 3,
            attempts_max: 5,
            queue_max: 300_000,
            tenant_queue_max: 250_000,
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

impl Jobs {
    /// Opens a data folder: locks it, makes the job table or asks for its form, and puts the `running` jobs of a dead
    /// process back into the queue (or ends them, if their attempts are used up). Nothing is solved before
    /// [`Jobs::start`].
    ///
    /// # Errors
    /// The folder is in use by another process, or cannot be used.
    pub async fn open(options: Options) -> Result<Jobs, JobsError> {
        Jobs::open_with(options, Recipe::contact()).await
    }

    /// As [`Jobs::open`], with another recipe.
    ///
    /// # Errors
    /// As [`Jobs::open`].
    pub async fn open_with(options: Options, recipe: Recipe) -> Result<Jobs, JobsError> {
        let lock = lock(&options.data_dir)?;
        let table = options.data_dir.join("jobs.db");
        // After an end that closed the table there is nothing to be checked.
        let closed = std::fs::remove_file(options.data_dir.join(CLOSED)).is_ok();
        let unclean = !closed && table.exists();
        let store = match SqliteStore::open(&table).await {
            Err(error) if error.trouble().is_some() && reserve::give_back(&options.data_dir) => {
                tracing::warn!(%error, "the job table is opened on the reserve");
                SqliteStore::open(&table).await?
            }
            opened => opened?,
        };
        if unclean {
            store.check().await?;
        }
        let results = Results::open(&options.data_dir)?;
        let underway = Underway {
            abandoned: store.incomplete_batches().await?.into_iter().collect(),
            ..Underway::default()
        };
        let (ended, _) = broadcast::channel(1024);
        let jobs = Jobs {
            tenant: ANONYMOUS.into(),
            shared: Arc::new(Shared {
                options,
                recipe,
                store,
                results,
                wake: Notify::new(),
                ended,
                running: Mutex::default(),
                draining: CancellationToken::new(),
                stopping: CancellationToken::new(),
                tasks: TaskTracker::new(),
                metrics: Metrics::new(),
                storage_failing: AtomicBool::new(false),
                trusted: Mutex::default(),
                checks: Semaphore::new(available_parallelism().map_or(1, usize::from)),
                staged: Staged::default(),
                batches: Mutex::new(underway),
                turns: Turns::default(),
                recent_batches: RecentLooks::default(),
                recent_jobs: RecentLooks::default(),
                leaps: Leaps::default(),
                solo: Arc::default(),
                suspects_waiting: AtomicUsize::new(0),
                abandoned: Arc::default(),
                broken: CancellationToken::new(),
                recovered: SetOnce::new(),
                lock: Mutex::new(Some(lock)),
            }),
        };
        match jobs.shared.recover().await {
            // What can be read is served; the rest is done once the disk takes data again.
            Err(error) if error.trouble().is_some() => {
                tracing::error!(%error, "the disk takes nothing; the service starts for reading");
            }
            recovered => {
                recovered?;
                reserve::keep(&jobs.shared.options.data_dir);
            }
        }
        Ok(jobs)
    }

    /// Starts the workers, the reaper of expired leases, the sweeps of orphaned results and of expired jobs, and the
    /// look-out for deadlines.
    ///
    /// # Errors
    /// A solver thread could not be started.
    pub fn start(&self) -> Result<(), JobsError> {
        for number in 0..self.shared.options.workers.max(1) {
            let worker = self.worker(&format!("solver-{number}"))?;
            self.shared.tasks.spawn(worker.run());
        }
        self.shared
            .tasks
            .spawn(housekeeping::reap_expired(self.shared.clone()));
        self.shared
            .tasks
            .spawn(housekeeping::sweep_orphans(self.shared.clone()));
        self.shared
            .tasks
            .spawn(housekeeping::recover(self.shared.clone()));
        self.shared
            .tasks
            .spawn(retention::sweep(self.shared.clone()));
        self.shared
            .tasks
            .spawn(wishes::keep_deadlines(self.shared.clone()));
        Ok(())
    }

    /// One worker that is not part of the pool; its [`step`](Worker::step) is called by whoever holds it.
    ///
    /// # Errors
    /// Its thread could not be started.
    pub fn worker(&self, name: &str) -> Result<Worker, JobsError> {
        Worker::new(self.shared.clone(), name)
    }

    /// Set when the process can do no better than end, in good order: too many solver threads do not stop.
    #[must_use]
    pub fn broken(&self) -> &CancellationToken {
        &self.shared.broken
    }

    /// Announces the end: not ready any more, no new claims, nobody waits any longer. Running jobs go on.
    pub fn drain(&self) {
        self.shared.draining.cancel();
    }

    /// Stops claiming, gives running jobs `grace` to end, hands the rest back to the queue uncounted, and closes.
    pub async fn shutdown(&self, grace: Duration) {
        self.drain();
        self.shared.tasks.close();
        if timeout(grace, self.shared.tasks.wait()).await.is_err() {
            self.shared.stopping.cancel();
            if timeout(STOPPED_WITHIN, self.shared.tasks.wait())
                .await
                .is_err()
            {
                tracing::warn!(
                    "some workers did not stop; their jobs will be taken back at the next start"
                );
            }
        }
        self.shared.store.close().await;
        let closed = self.shared.options.data_dir.join(CLOSED);
        let marked = File::options()
            .create(true)
            .truncate(true)
            .write(true)
            .mode(0o600)
            .open(closed);
        if let Err(error) = marked {
            tracing::debug!(%error, "the next start will check the job table");
        }
        drop(
            self.shared
                .lock
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .take(),
        );
    }
}

/// Makes a folder that nobody else may read, if there is none, whatever the umask.
pub(super) fn make_private_folder(path: &Path) -> std::io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

/// Creates the data folder if needed and takes it for this process alone. The system frees the lock when the process
/// ends, however it ends.
fn lock(data_dir: &Path) -> Result<File, JobsError> {
    let failed = |path: &Path, source| JobsError::DataDir {
        path: path.to_owned(),
        source,
    };
    make_private_folder(data_dir).map_err(|source| failed(data_dir, source))?;
    let path = data_dir.join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(&path)
        .map_err(|source| failed(&path, source))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(JobsError::DataDirInUse(data_dir.to_owned())),
        Err(TryLockError::Error(source)) => Err(failed(&path, source)),
    }
}
