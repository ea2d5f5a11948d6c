//! How [`Jobs`] is opened, started and stopped.

use std::fs::{File, TryLockError};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::{AtomicI64, AtomicUsize};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::available_parallelism;
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::{ContextV7, Uuid};

use crate::attempts::attempt::AllLeases;
use crate::attempts::fair_scheduler::FairScheduler;
use crate::blobs::Blobs;
use crate::clock::ClockSteps;
use crate::disk_reserve::{self, make_private_folder};
use crate::engine::Engine;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::maintenance;
use crate::metrics::Metrics;
use crate::model::{ANONYMOUS, Kind};
use crate::open_store::{note_closed, open_for_service};
use crate::options::Options;
use crate::recent_reads::RecentReads;
use crate::result_place::settle::settle;
use crate::shared::{Shared, UnfinishedBatches};
use crate::staged_bytes::StagedBytes;
use crate::storage_fault::StorageFaults;
use crate::store::{Node, Store};
use crate::sync::lock;
use crate::worker::pool::Worker;

/// How long a shutdown waits for workers that were told to stop.
const STOPPED_WITHIN: Duration = Duration::from_secs(10);

impl Jobs {
    /// Opens a data folder: locks it, makes the job table or asks for its form, and puts the `running` jobs of a dead
    /// process back into the queue (or ends them, if their attempts are used up). With a database the folder is for
    /// batches that are being received, and running jobs are those of other processes. Nothing is solved before
    /// [`Jobs::start`].
    ///
    /// # Errors
    /// The folder is in use by another process, or cannot be used.
    pub async fn open(options: Options) -> Result<Jobs> {
        Jobs::open_with(options, Engine::contact()).await
    }

    /// As [`Jobs::open`], with another engine.
    ///
    /// # Errors
    /// As [`Jobs::open`].
    pub async fn open_with(options: Options, engine: Engine) -> Result<Jobs> {
        let lock = lock_folder(&options.data_dir)?;
        let store = open_for_service(&options.data_dir, options.database.as_ref()).await?;
        let (metrics, registry) = Metrics::new();
        let blobs = open_blobs(&*store, &options, &metrics).await?;
        let clock_offset_ms = Arc::<AtomicI64>::default();
        let options = Options {
            clock: options.clock.clone().ahead(clock_offset_ms.clone()),
            ..options
        };
        let unfinished_batches = UnfinishedBatches {
            abandoned: store.unfinished_batches().await?.into_iter().collect(),
            ..UnfinishedBatches::default()
        };
        let (ended, _) = broadcast::channel(1024);
        let jobs = Jobs {
            tenant: ANONYMOUS.into(),
            kind: Kind::Case,
            bound: Arc::default(),
            shared: Arc::new(Shared {
                node: Node {
                    id: Uuid::now_v7(),
                    workers: options.workers,
                },
                cluster_workers: AtomicUsize::new(0),
                clock_offset_ms,
                id_context: Mutex::new(ContextV7::new()),
                options,
                engine,
                store,
                blobs,
                wake: Notify::new(),
                ended,
                leases: AllLeases::default(),
                heartbeat: OnceLock::new(),
                draining: CancellationToken::new(),
                stopping: CancellationToken::new(),
                tasks: TaskTracker::new(),
                metrics,
                registry,
                storage: StorageFaults::default(),
                trusted: Mutex::default(),
                checks: Semaphore::new(available_parallelism().map_or(1, usize::from)),
                staged: StagedBytes::default(),
                batches: Mutex::new(unfinished_batches),
                turns: FairScheduler::default(),
                recent: RecentReads::default(),
                leaps: ClockSteps::default(),
                suspect: Arc::default(),
                long_solves: AtomicUsize::new(0),
                wake_spare: Notify::new(),
                abandoned: Arc::default(),
                broken: CancellationToken::new(),
                recovered: SetOnce::new(),
                lock: Mutex::new(Some(lock)),
            }),
        };
        if let Some(cluster) = jobs.shared.store.cluster() {
            jobs.shared.show_node(cluster).await?;
        }
        match jobs.shared.recover().await {
            // What can be read is served; the rest is done once the disk accepts writes again.
            Err(error) if error.storage_fault().is_some() => {
                tracing::error!(%error, "the disk rejects writes; the service starts read-only");
            }
            recovered => {
                recovered?;
                disk_reserve::keep(&jobs.shared.options.data_dir);
            }
        }
        Ok(jobs)
    }

    /// Starts the workers, the reaper of expired leases, the sweeps of orphaned results and of expired jobs, and the
    /// look-out for deadlines.
    ///
    /// # Errors
    /// A solver thread could not be started.
    pub fn start(&self) -> Result<()> {
        let workers = self.shared.options.workers;
        // A process without workers has no spare one either.
        let threads = if workers == 0 { 0 } else { workers + 1 };
        for number in 0..threads {
            let mut worker = self.worker(&format!("solver-{number}"))?;
            worker.spare = number == workers;
            let runs = self.shared.tasks.track_future(worker.run());
            let runtime = Handle::current();
            // A thread of its own may wait for the disk of the embedded table.
            std::thread::Builder::new()
                .name(format!("worker-{number}"))
                .spawn(move || runtime.block_on(runs))
                .map_err(JobsError::Thread)?;
        }
        maintenance::start(&self.shared);
        Ok(())
    }

    /// One worker that is not part of the pool; its [`step`](Worker::step) is called by whoever holds it.
    ///
    /// # Errors
    /// Its thread could not be started.
    pub fn worker(&self, name: &str) -> Result<Worker> {
        Worker::new(self.shared.clone(), name)
    }

    /// Set when the process can do no better than end, in good order: too many solver threads do not stop.
    #[must_use]
    pub fn broken(&self) -> &CancellationToken {
        &self.shared.broken
    }

    /// Begins to drain: the service is not ready, nothing is claimed, waiting calls return. Running jobs go on.
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
                    "some workers did not stop; their jobs return to the queue at the next start"
                );
            }
        }
        if let Some(cluster) = self.shared.store.cluster() {
            // Who does not say so is forgotten a moment later.
            let _ = timeout(STOPPED_WITHIN, cluster.leave(self.shared.node.id)).await;
        }
        self.shared.store.close().await;
        if self.shared.options.database.is_none() && !self.shared.storage.damaged() {
            note_closed(&self.shared.options.data_dir);
        }
        if let Some(held) = lock(&self.shared.lock).take() {
            // A program that is being started has a copy of the file for a moment, so closing it does not free the lock.
            let _ = held.unlock();
        }
    }
}

/// The place of large results: a folder of the data folder, or what all nodes of a database have in common.
async fn open_blobs(store: &dyn Store, options: &Options, metrics: &Metrics) -> Result<Blobs> {
    match (store.cluster(), &options.results) {
        (Some(cluster), place) => {
            settle(cluster, place.as_ref(), metrics.store_requests.clone()).await
        }
        (None, None) => Blobs::open(&options.data_dir),
        (None, Some(_)) => Err(JobsError::ResultPlace(
            "--results-url requires --database-url; without a database, results are in the data folder, which `railhead backup` copies"
                .to_owned(),
        )),
    }
}

/// Creates the data folder if needed and takes it for this process alone. The system frees the lock when the process
/// ends, however it ends.
pub(crate) fn lock_folder(data_dir: &Path) -> Result<File> {
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
