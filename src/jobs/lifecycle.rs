//! Opening, starting and stopping of [`Jobs`].

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

use crate::attempts::attempt::{AllLeases, SolverThread};
use crate::attempts::fair_scheduler::FairScheduler;
use crate::blobs::Blobs;
use crate::clock::ClockSteps;
use crate::data_dir::{self, lock_folder, note_closed};
use crate::engine::Engine;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::maintenance;
use crate::metrics::Metrics;
use crate::model::{ANONYMOUS, Kind};
use crate::options::Options;
use crate::result_place::settle::settle;
use crate::shared::{Shared, StagedBytes, UnfinishedBatches};
use crate::storage_fault::StorageFaults;
use crate::store::open::open_for_service;
use crate::store::{Node, Store};
use crate::sync::lock;
use crate::work::RecentReads;
use crate::worker::pool::Worker;

/// How long a shutdown waits for workers after it has stopped their solvers.
const STOPPED_WITHIN: Duration = Duration::from_secs(10);

impl Jobs {
    /// Opens a data folder: locks it, creates or checks the job table, and returns the `running` jobs of a crashed process
    /// to the queue, or ends them if their attempts are used up. With a database the folder only holds batches that are
    /// being received, and running jobs belong to other processes. Nothing is solved before [`Jobs::start`].
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
                long_solves: Arc::default(),
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
            // The service starts read-only; recovery is repeated until the disk accepts writes.
            Err(error) if error.storage_fault().is_some() => {
                tracing::error!(%error, "the disk rejects writes; the service starts read-only");
            }
            recovered => {
                recovered?;
                jobs.shared.probe_disk().await;
                data_dir::keep_reserve(&jobs.shared.options.data_dir);
            }
        }
        Ok(jobs)
    }

    /// Starts the workers and the periodic tasks: reaper of expired leases, deadlines, expiry and sweep of orphaned results.
    ///
    /// # Errors
    /// A solver thread could not be started.
    pub fn start(&self) -> Result<()> {
        let workers = self.shared.options.workers;
        // A process without workers has no spare worker either.
        let threads = if workers == 0 { 0 } else { workers + 1 };
        for number in 0..threads {
            let mut worker = self.worker(&format!("solver-{number}"))?;
            worker.spare = number == workers;
            let runs = self.shared.tasks.track_future(worker.run());
            let runtime = Handle::current();
            // A separate thread may block on the disk of the embedded table.
            std::thread::Builder::new()
                .name(format!("worker-{number}"))
                .spawn(move || runtime.block_on(runs))
                .map_err(JobsError::Thread)?;
        }
        maintenance::start(&self.shared);
        Ok(())
    }

    /// A worker that is not part of the pool; the caller calls its [`step`](Worker::step).
    ///
    /// # Errors
    /// Its thread could not be started.
    pub fn worker(&self, name: &str) -> Result<Worker> {
        Ok(Worker {
            thread: Some(SolverThread::start(name)?),
            shared: self.shared.clone(),
            name: name.to_owned(),
            spare: false,
        })
    }

    /// Cancelled when the process should shut down because too many solver threads were abandoned.
    #[must_use]
    pub fn broken(&self) -> &CancellationToken {
        &self.shared.broken
    }

    /// Begins to drain: the service is not ready, nothing is claimed, waiting calls return. Running jobs continue.
    pub fn drain(&self) {
        self.shared.draining.cancel();
    }

    /// Stops claiming, gives running jobs `grace` to end, returns the others to the queue without counting the attempt, and closes.
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
            // Without this the other nodes notice the absence a moment later.
            let _ = timeout(STOPPED_WITHIN, cluster.leave(self.shared.node.id)).await;
        }
        self.shared.store.close().await;
        if self.shared.options.database.is_none() && !self.shared.storage.damaged() {
            note_closed(&self.shared.options.data_dir);
        }
        if let Some(held) = lock(&self.shared.lock).take() {
            // Closing the file does not free the lock if a child process that is being started still has a copy of it.
            let _ = held.unlock();
        }
    }
}

/// Opens the location of large results: a folder in the data folder, or the location that all nodes of a database share.
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
