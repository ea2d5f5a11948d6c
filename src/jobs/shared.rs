//! What all handles and workers of a process use together.

use std::collections::HashSet;
use std::fs::File;
use std::sync::atomic::{AtomicI64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::time::Duration;

use prometheus_client::registry::Registry;
use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::{ContextV7, Timestamp, Uuid};

use crate::attempts::attempt::AllLeases;
use crate::attempts::fair_scheduler::FairScheduler;
use crate::blobs::Blobs;
use crate::clock::{ClockStep, ClockSteps};
use crate::engine::Engine;
use crate::metrics::Metrics;
use crate::model::Trusted;
use crate::options::Options;
use crate::recent_reads::RecentReads;
use crate::staged_bytes::StagedBytes;
use crate::storage_fault::StorageFaults;
use crate::store::{Lease, Node, Notification, Store};
use crate::sync::lock;
use crate::work::Work;

/// How often a waiting caller reads again although nothing was announced.
pub(crate) const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// What every handle and every worker shares.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) options: Options,
    pub(crate) engine: Engine,
    pub(crate) store: Arc<dyn Store>,
    pub(crate) blobs: Blobs,
    /// This process among those that share its store.
    pub(crate) node: Node,
    /// Workers of all nodes that share its store, as far as it is known.
    pub(crate) cluster_workers: AtomicUsize,
    /// How far the clock of the store is ahead of that of this machine.
    pub(crate) clock_offset_ms: Arc<AtomicI64>,
    /// Wakes an idle worker; a hint only, workers also poll.
    pub(crate) wake: Notify,
    /// Announces ended jobs; a hint only, waiting callers also poll.
    pub(crate) ended: broadcast::Sender<Uuid>,
    /// The leases that this process holds, and its heartbeat once there was one.
    pub(crate) leases: AllLeases,
    pub(crate) heartbeat: OnceLock<()>,
    /// Set when the service is about to stop: no new claims, not ready, no more waiting.
    pub(crate) draining: CancellationToken,
    /// Set when the grace period is over: running jobs are handed back.
    pub(crate) stopping: CancellationToken,
    pub(crate) tasks: TaskTracker,
    pub(crate) metrics: Metrics,
    pub(crate) registry: Registry,
    /// Which of the places that it writes to fail.
    pub(crate) storage: StorageFaults,
    /// Keys found good a moment ago.
    pub(crate) trusted: Mutex<Trusted>,
    /// Cases of single jobs that may be checked at the same time.
    pub(crate) checks: Semaphore,
    /// Bytes of batches that are being received.
    pub(crate) staged: StagedBytes,
    /// Batches that are being received or filled, and those that are to be removed.
    pub(crate) batches: Mutex<UnfinishedBatches>,
    /// Jobs, batches and runs that clients follow, as they were read a moment ago.
    pub(crate) recent: RecentReads<Option<Work>>,
    /// Steps of the wall clock.
    pub(crate) leaps: ClockSteps,
    /// Whose turn it is.
    pub(crate) turns: FairScheduler,
    /// Held while a job is solved that may have killed a process.
    pub(crate) suspect: Arc<tokio::sync::Mutex<()>>,
    /// Solves that have taken longer than a slice while others wait.
    pub(crate) long_solves: AtomicUsize,
    /// Wakes the spare worker.
    pub(crate) wake_spare: Notify,
    /// Solver threads that did not stop and still run.
    pub(crate) abandoned: Arc<AtomicUsize>,
    /// Set when there are too many of them.
    pub(crate) broken: CancellationToken,
    /// What a dead process left is taken back; nothing is claimed before.
    pub(crate) recovered: SetOnce<()>,
    /// Held as long as this process uses the data folder.
    pub(crate) lock: Mutex<Option<File>>,
    /// Ids that are made with the clock of the store grow within a millisecond too.
    pub(crate) id_context: Mutex<ContextV7>,
}

/// Batches that are not acknowledged: being received and filled, or given up and to be removed.
#[derive(Debug, Default)]
pub(crate) struct UnfinishedBatches {
    /// Being received or filled by this process.
    pub(crate) living: HashSet<Uuid>,
    /// Given up: their jobs are neither solved nor shown, and are removed as soon as the disk allows it.
    pub(crate) abandoned: HashSet<Uuid>,
}

impl UnfinishedBatches {
    /// This process neither receives nor fills this batch any more.
    pub(crate) fn forget(&mut self, id: Uuid) {
        self.living.remove(&id);
    }
}

impl Shared {
    /// The present, epoch milliseconds.
    pub(crate) fn now_ms(&self) -> i64 {
        self.options.clock.now_ms()
    }

    /// Milliseconds of the steady clock, with which leases are measured.
    pub(crate) fn steady_ms(&self) -> i64 {
        self.options.clock.steady_ms()
    }

    /// The time from a claim or a heartbeat until the job is given away, in ms.
    pub(crate) fn lease_ms(&self) -> i64 {
        i64::try_from(self.options.lease.as_millis()).unwrap_or(i64::MAX)
    }

    /// How far the wall clock has leapt since the start.
    pub(crate) fn clock_step(&self) -> ClockStep {
        self.leaps.measure(&self.options.clock)
    }

    /// A lease that begins now.
    pub(crate) fn lease(&self) -> Lease {
        Lease {
            now: self.steady_ms(),
            ms: self.lease_ms(),
        }
    }

    /// When a lease that begins now runs out.
    pub(crate) fn lease_until(&self) -> i64 {
        self.steady_ms().saturating_add(self.lease_ms())
    }

    /// An id for a job that is submitted now.
    pub(crate) fn new_id(&self) -> Uuid {
        let offset = self.clock_offset_ms.load(Ordering::Relaxed);
        if offset == 0 {
            return Uuid::now_v7();
        }
        let now = self.now_ms().max(0);
        let nanos = u32::try_from(now % 1000).unwrap_or(0) * 1_000_000;
        let seconds = now.unsigned_abs() / 1000;
        Uuid::new_v7(Timestamp::from_unix(&self.id_context, seconds, nanos))
    }

    /// Workers of all nodes.
    pub(crate) fn all_workers(&self) -> usize {
        let others = self.cluster_workers.load(Ordering::Relaxed);
        self.options.workers.max(others)
    }

    /// Whether every worker is at a solve that has taken longer than a slice while others wait.
    pub(crate) fn all_workers_are_long(&self) -> bool {
        self.long_solves.load(Ordering::Acquire) >= self.options.workers
    }

    /// Wakes one worker for one job.
    pub(crate) fn wake_worker(&self) {
        self.wake.notify_one();
        self.publish(Notification::Work);
    }

    /// Tells workers that there is something to be claimed.
    pub(crate) fn wake_workers(&self) {
        self.wake_here();
        self.publish(Notification::Work);
    }

    /// The same, only those of this process.
    pub(crate) fn wake_here(&self) {
        self.wake.notify_waiters();
        self.wake.notify_one();
    }

    /// Rings at all nodes, if there are others.
    pub(crate) fn publish(&self, notification: Notification) {
        if let Some(cluster) = self.store.cluster() {
            cluster.publish(notification);
        }
    }

    /// Tells waiting callers, those of other nodes too, that a job has ended.
    pub(crate) fn announce(&self, id: Uuid) {
        self.announce_here(id);
        self.publish(Notification::Ended(id));
    }

    /// The same, only those of this process.
    pub(crate) fn announce_here(&self, id: Uuid) {
        // It is no error if no caller waits.
        let _ = self.ended.send(id);
    }
}

impl Shared {
    /// Batches that are not acknowledged.
    pub(crate) fn unfinished_batches(&self) -> MutexGuard<'_, UnfinishedBatches> {
        lock(&self.batches)
    }
}

/// Time between two heartbeats of a worker, and between two rounds of the reaper.
pub(crate) fn heartbeat(shared: &Shared) -> Duration {
    (shared.options.lease / 3).max(Duration::from_millis(1))
}
