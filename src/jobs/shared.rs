//! State that all handles and workers of a process share.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::File;
use std::sync::atomic::{AtomicI64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use prometheus_client::registry::Registry;
use serde_json::Value;
use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::{ContextV7, Timestamp, Uuid};

use crate::attempts::attempt::AllLeases;
use crate::attempts::fair_scheduler::FairScheduler;
use crate::blobs::Blobs;
use crate::clock::{ClockStep, ClockSteps};
use crate::engine::Engine;
use crate::error::{JobsError, Result};
use crate::metrics::Metrics;
use crate::model::Trusted;
use crate::options::{Options, StagingBounds};
use crate::storage_fault::StorageFaults;
use crate::store::{Lease, Node, Notification, Store};
use crate::sync::lock;
use crate::work::{RecentReads, Work};
use railhead_contact::evaluate::many::ManyTask;
use railhead_contact::evaluate::varied::VariedColumn;

/// Interval at which a waiting caller reads again without an announcement.
pub(crate) const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// State that all handles and workers of a process share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) options: Options,
    pub(crate) engine: Engine,
    pub(crate) store: Arc<dyn Store>,
    pub(crate) blobs: Blobs,
    /// This process as a node of the cluster.
    pub(crate) node: Node,
    /// Number of workers of all live nodes, as last read.
    pub(crate) cluster_workers: AtomicUsize,
    /// Offset of the clock of the store from the clock of this machine.
    pub(crate) clock_offset_ms: Arc<AtomicI64>,
    /// Wakes an idle worker. Workers also poll.
    pub(crate) wake: Notify,
    /// Announces ended jobs. Waiting callers also poll.
    pub(crate) ended: broadcast::Sender<Uuid>,
    /// The leases that this process holds.
    pub(crate) leases: AllLeases,
    /// Set once the heartbeat task runs.
    pub(crate) heartbeat: OnceLock<()>,
    /// Cancelled when the service begins to stop: no new claims, not ready, no waiting.
    pub(crate) draining: CancellationToken,
    /// Cancelled when the grace period is over: running jobs return to the queue.
    pub(crate) stopping: CancellationToken,
    pub(crate) tasks: TaskTracker,
    pub(crate) metrics: Metrics,
    pub(crate) registry: Registry,
    /// Current faults of the storage locations.
    pub(crate) storage: StorageFaults,
    /// Recently validated keys.
    pub(crate) trusted: Mutex<Trusted>,
    /// Limits the number of large cases that are checked at the same time.
    pub(crate) checks: Semaphore,
    /// Bytes of batches that are being received.
    pub(crate) staged: StagedBytes,
    /// Batches that are not acknowledged.
    pub(crate) batches: Mutex<UnfinishedBatches>,
    /// Recent reads of work that clients follow.
    pub(crate) recent: RecentReads<Option<Work>>,
    /// Jumps of the wall clock.
    pub(crate) leaps: ClockSteps,
    /// Solver time used by each queue.
    pub(crate) turns: FairScheduler,
    /// Held while a job runs that may have crashed a process.
    pub(crate) suspect: Arc<tokio::sync::Mutex<()>>,
    /// Number of solves that have exceeded a slice while other work waits.
    pub(crate) long_solves: Arc<AtomicUsize>,
    /// Wakes the spare worker.
    pub(crate) wake_spare: Notify,
    /// Number of abandoned solver threads that still run.
    pub(crate) abandoned: Arc<AtomicUsize>,
    /// Cancelled when too many solver threads were abandoned.
    pub(crate) broken: CancellationToken,
    /// Set once the jobs of a crashed process are back in the queue; nothing is claimed before.
    pub(crate) recovered: SetOnce<()>,
    /// Lock of the data folder.
    pub(crate) lock: Mutex<Option<File>>,
    /// Keeps ids increasing within a millisecond if they are created with the clock of the store.
    pub(crate) id_context: Mutex<ContextV7>,
}

/// Batches that are not acknowledged.
#[derive(Debug, Default)]
pub(crate) struct UnfinishedBatches {
    /// Batches that this process is receiving or filling.
    pub(crate) living: HashSet<Uuid>,
    /// Abandoned batches: their jobs are neither solved nor shown, and are removed as soon as storage permits.
    pub(crate) abandoned: HashSet<Uuid>,
}

/// Bytes of batches that are being received, by tenant. A row of a table counts with its template.
#[derive(Debug, Default)]
pub(crate) struct StagedBytes(Mutex<HashMap<Arc<str>, u64>>);

impl StagedBytes {
    /// Adds bytes of a tenant.
    ///
    /// # Errors
    /// [`JobsError::StagingQuotaExceeded`] or [`JobsError::StagingFull`].
    pub(crate) fn add(&self, tenant: &str, bytes: u64, bounds: StagingBounds) -> Result<()> {
        let mut staged = lock(&self.0);
        let of_tenant = staged.get(tenant).copied().unwrap_or(0);
        if of_tenant + bytes > bounds.tenant {
            return Err(JobsError::StagingQuotaExceeded(bounds.tenant));
        }
        if staged.values().sum::<u64>() + bytes > bounds.all {
            return Err(JobsError::StagingFull(bounds.all));
        }
        staged.insert(tenant.into(), of_tenant + bytes);
        Ok(())
    }

    /// Number of staged bytes of a tenant.
    pub(crate) fn of(&self, tenant: &str) -> u64 {
        let staged = lock(&self.0);
        staged.get(tenant).copied().unwrap_or(0)
    }

    /// Subtracts bytes of a tenant.
    pub(crate) fn give_back(&self, tenant: &str, bytes: u64) {
        let mut staged = lock(&self.0);
        let left = staged.get(tenant).map_or(0, |of| of.saturating_sub(bytes));
        if left == 0 {
            staged.remove(tenant);
        } else {
            staged.insert(tenant.into(), left);
        }
    }
}

impl Shared {
    /// The current time, epoch milliseconds.
    pub(crate) fn now_ms(&self) -> i64 {
        self.options.clock.now_ms()
    }

    /// The time of the steady clock in ms, by which leases are measured.
    pub(crate) fn steady_ms(&self) -> i64 {
        self.options.clock.steady_ms()
    }

    /// Length of a lease in ms.
    pub(crate) fn lease_ms(&self) -> i64 {
        i64::try_from(self.options.lease.as_millis()).unwrap_or(i64::MAX)
    }

    /// The jump of the wall clock since the start.
    pub(crate) fn clock_step(&self) -> ClockStep {
        self.leaps.measure(&self.options.clock)
    }

    /// Rows to solve with the limits of this service.
    pub(crate) fn rows_task<'a>(
        &'a self,
        case: &'a Value,
        columns: &'a [VariedColumn],
        profiles: &'a BTreeMap<String, Value>,
    ) -> ManyTask<'a> {
        ManyTask {
            case,
            columns,
            profiles,
            known: &self.engine.known,
            limits: &self.options.limits,
            time_limit: self.options.time_limit,
        }
    }

    /// A lease that begins now.
    pub(crate) fn lease(&self) -> Lease {
        Lease {
            now: self.steady_ms(),
            ms: self.lease_ms(),
        }
    }

    /// Time at which a lease that begins now expires.
    pub(crate) fn lease_until(&self) -> i64 {
        self.steady_ms().saturating_add(self.lease_ms())
    }

    /// Creates the id of a job that is submitted now.
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

    /// Number of workers of all nodes.
    pub(crate) fn all_workers(&self) -> usize {
        let others = self.cluster_workers.load(Ordering::Relaxed);
        self.options.workers.max(others)
    }

    /// Wakes one worker of each node.
    pub(crate) fn wake_worker(&self) {
        self.wake.notify_one();
        self.publish(Notification::Work);
    }

    /// Wakes all workers of all nodes.
    pub(crate) fn wake_workers(&self) {
        self.wake_here();
        self.publish(Notification::Work);
    }

    /// Wakes all workers of this process.
    pub(crate) fn wake_here(&self) {
        self.wake.notify_waiters();
        self.wake.notify_one();
    }

    /// Sends a notification to all nodes, if there are others.
    pub(crate) fn publish(&self, notification: Notification) {
        if let Some(cluster) = self.store.cluster() {
            cluster.publish(notification);
        }
    }

    /// Announces an ended job to the waiting callers of all nodes.
    pub(crate) fn announce(&self, id: Uuid) {
        self.announce_here(id);
        self.publish(Notification::Ended(id));
    }

    /// Announces an ended job to the waiting callers of this process.
    pub(crate) fn announce_here(&self, id: Uuid) {
        // An error means that nobody waits.
        let _ = self.ended.send(id);
    }
}

/// Interval between heartbeats, and between runs of the reaper.
pub(crate) fn heartbeat(shared: &Shared) -> Duration {
    (shared.options.lease / 3).max(Duration::from_millis(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_bounded_per_tenant_and_in_all_and_come_back() {
        let staged = StagedBytes::default();
        let bounds = StagingBounds {
            all: 150,
            tenant: 100,
        };
        let (a, b): (Arc<str>, Arc<str>) = ("a".into(), "b".into());
        staged.add(&a, 100, bounds).unwrap();
        let refused = staged.add(&a, 1, bounds);
        assert!(matches!(refused, Err(JobsError::StagingQuotaExceeded(100))));
        let refused = staged.add(&b, 51, bounds);
        assert!(matches!(refused, Err(JobsError::StagingFull(150))));
        staged.add(&b, 50, bounds).unwrap();
        staged.give_back(&a, 100);
        staged.add(&b, 50, bounds).unwrap();
        staged.add(&a, 50, bounds).unwrap();
    }
}
