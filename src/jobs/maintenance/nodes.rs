//! Tasks of a node of a cluster: it reports itself, receives notifications, keeps the batches that it fills, and polls for
//! changes that notifications missed.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval, sleep};
use uuid::Uuid;

use crate::attempts::attempt::StopReason;
use crate::error::Result;
use crate::maintenance::every;
use crate::shared::Shared;
use crate::store::{Cluster, Notification};
use crate::sync::lock;

/// Interval between two reports of a node; the store counts a node as dead after four missed ones.
const BEAT_EVERY: Duration = Duration::from_secs(5);

/// Interval between two polls for running jobs that are to be cancelled.
const CANCEL_EVERY: Duration = Duration::from_millis(500);

/// Interval at which the counters in the database are summed up.
const FOLD_EVERY: Duration = Duration::from_secs(2);

/// Pause after the connection for notifications has failed.
const LISTEN_AGAIN: Duration = Duration::from_secs(1);

/// Longest round trip that is used to measure the clock of the store, in ms.
const MEASURED_WITHIN: i64 = 500;

/// Smaller clock offsets are ignored, in ms.
const OFFSET_MIN: i64 = 250;

/// Clock offsets of at least this size are logged, in ms.
const OFFSET_TOLD: i64 = 1000;

/// Starts the tasks of a node.
pub(super) fn start(shared: &Arc<Shared>) {
    every(
        shared,
        BEAT_EVERY,
        "the heartbeat of this node failed",
        beat,
    );
    every(shared, FOLD_EVERY, "counts could not be added up", fold);
    shared.tasks.spawn(watch_cancellations(shared.clone()));
    shared.tasks.spawn(listen(shared.clone()));
}

impl Shared {
    /// Reports this node to the others and sets its clock by that of the store.
    pub(crate) async fn show_node(&self, cluster: &dyn Cluster) -> Result<()> {
        self.set_clock(cluster).await?;
        let workers = cluster.beat(&self.node).await?;
        self.cluster_workers.store(workers, Ordering::Relaxed);
        Ok(())
    }

    /// Measures the offset of the clock of the store. Slow round trips are ignored as inaccurate, and small offsets as
    /// measurement errors.
    async fn set_clock(&self, cluster: &dyn Cluster) -> Result<()> {
        let asked = self.steady_ms();
        let there = cluster.now().await?;
        let taken = self.steady_ms() - asked;
        if taken > MEASURED_WITHIN {
            return Ok(());
        }
        let here = jiff::Timestamp::now().as_millisecond() - taken / 2;
        let offset = match there - here {
            small if small.abs() < OFFSET_MIN => 0,
            offset => offset,
        };
        let before = self.clock_offset_ms.swap(offset, Ordering::Relaxed);
        if (offset - before).abs() >= OFFSET_TOLD {
            tracing::warn!(
                offset_ms = offset,
                "the clock of this machine differs from that of the database, which is used"
            );
        }
        Ok(())
    }

    /// Handles a notification.
    fn hear(&self, notification: Notification) {
        match notification {
            Notification::Work => self.wake_here(),
            Notification::Ended(id) => self.announce_here(id),
            Notification::Cancel(id) => drop(self.leases.stop(id, StopReason::Cancel)),
        }
    }
}

async fn beat(shared: Arc<Shared>) -> Result<()> {
    let Some(cluster) = shared.store.cluster() else {
        return Ok(());
    };
    shared.show_node(cluster).await?;
    keep_batches(&shared, cluster).await
}

/// Keeps the batches that this node fills, and takes over those that no node fills, to remove them.
async fn keep_batches(shared: &Shared, cluster: &dyn Cluster) -> Result<()> {
    let living: Vec<Uuid> = {
        let batches = lock(&shared.batches);
        batches.living.iter().copied().collect()
    };
    if !living.is_empty() {
        cluster.keep_batches(&living).await?;
    }
    let left = shared.store.unfinished_batches().await?;
    let mut batches = lock(&shared.batches);
    let left = left.into_iter().filter(|id| !living.contains(id));
    batches.abandoned.extend(left);
    Ok(())
}

async fn watch_cancellations(shared: Arc<Shared>) {
    let mut beat = interval(CANCEL_EVERY);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        // Also while the node drains, because its running jobs have a grace period.
        if shared
            .stopping
            .run_until_cancelled(beat.tick())
            .await
            .is_none()
            || shared.draining.is_cancelled() && shared.leases.ids().is_empty()
        {
            return;
        }
        let running = shared.leases.ids();
        let Some(cluster) = shared.store.cluster().filter(|_| !running.is_empty()) else {
            continue;
        };
        match cluster.cancel_requests(&running).await {
            Ok(ids) => ids.into_iter().for_each(|id| {
                shared.leases.stop(id, StopReason::Cancel);
            }),
            Err(error) => tracing::debug!(%error, "cancellations could not be read"),
        }
    }
}

async fn fold(shared: Arc<Shared>) -> Result<()> {
    match shared.store.cluster() {
        Some(cluster) => Ok(cluster.fold_counts().await?),
        None => Ok(()),
    }
}

async fn listen(shared: Arc<Shared>) {
    let draining = shared.draining.clone();
    let hear = |notification| shared.hear(notification);
    let listening = async {
        while let Some(cluster) = shared.store.cluster() {
            if let Err(error) = cluster.listen(&hear).await {
                tracing::warn!(%error, "notifications of other nodes cannot be received; the table is polled");
            }
            sleep(LISTEN_AGAIN).await;
        }
    };
    draining.run_until_cancelled(listening).await;
}
