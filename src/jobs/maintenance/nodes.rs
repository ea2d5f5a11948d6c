//! What a node does because others use its store too: it shows itself, listens to the notifications of the others, keeps the batches
//! that it is filling, and looks for what the notifications did not tell.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval, sleep};
use uuid::Uuid;

use crate::attempts::attempt::StopReason;
use crate::error::JobsError;
use crate::maintenance::{every, note_swept};
use crate::shared::Shared;
use crate::store::{Cluster, ClusterView, Notification, Result};

/// Time between two signs of life; the store counts a node as dead after four.
const BEAT_EVERY: Duration = Duration::from_secs(5);

/// Time between two looks for running jobs that are to be cancelled.
const CANCEL_EVERY: Duration = Duration::from_millis(500);

/// Time between two rounds in which counts are brought into a short form.
const FOLD_EVERY: Duration = Duration::from_secs(2);

/// Time between two sweeps of results that no job refers to.
const SWEEP_EVERY: Duration = Duration::from_secs(3600);

/// Pause after a connection for notifications has failed.
const LISTEN_AGAIN: Duration = Duration::from_secs(1);

/// Longest round trip that tells the time of the store, in ms.
const MEASURED_WITHIN: i64 = 500;

/// Smaller differences of the clocks are left alone, in ms.
const OFFSET_MIN: i64 = 250;

/// A clock that is off by so much is worth a line in the log, in ms.
const OFFSET_TOLD: i64 = 1000;

/// Starts all of this.
pub(super) fn start(shared: &Arc<Shared>) {
    every(shared, BEAT_EVERY, beat);
    every(shared, FOLD_EVERY, fold);
    every(shared, SWEEP_EVERY, sweep);
    shared.tasks.spawn(watch_cancellations(shared.clone()));
    shared.tasks.spawn(listen(shared.clone()));
}

impl Shared {
    /// Shows this node to the others and sets its clock by that of the store.
    pub(crate) async fn show_node(&self, cluster: &dyn Cluster) -> Result<ClusterView> {
        self.set_clock(cluster).await?;
        let view = cluster.beat(&self.node).await?;
        self.cluster_workers.store(view.workers, Ordering::Relaxed);
        Ok(view)
    }

    /// How far the clock of the store is ahead. An answer that took long says little, and a small difference is one of the
    /// measurement.
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

    /// Does what a notification asks for.
    fn hear(&self, notification: Notification) {
        match notification {
            Notification::Work => self.wake_here(),
            Notification::Ended(id) => self.announce_here(id),
            Notification::Cancel(id) => drop(self.leases.stop(id, StopReason::Cancel)),
        }
    }
}

async fn beat(shared: Arc<Shared>) {
    let Some(cluster) = shared.store.cluster() else {
        return;
    };
    if let Err(error) = shared.show_node(cluster).await {
        tracing::warn!(%error, "the heartbeat of this node failed");
    } else if let Err(error) = keep_batches(&shared, cluster).await {
        tracing::warn!(%error, "batches that are being filled could not be kept");
    }
}

/// Keeps the batches that this node fills, and takes up those that nobody fills any more, to remove them.
async fn keep_batches(shared: &Shared, cluster: &dyn Cluster) -> Result<()> {
    let living: Vec<Uuid> = {
        let batches = shared.unfinished_batches();
        batches.living.iter().copied().collect()
    };
    if !living.is_empty() {
        cluster.keep_batches(&living).await?;
    }
    let left = shared.store.unfinished_batches().await?;
    let mut batches = shared.unfinished_batches();
    let left = left.into_iter().filter(|id| !living.contains(id));
    batches.abandoned.extend(left);
    Ok(())
}

async fn watch_cancellations(shared: Arc<Shared>) {
    let mut beat = interval(CANCEL_EVERY);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        // Also while the node drains: its running jobs have a grace period.
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

async fn fold(shared: Arc<Shared>) {
    if let Some(cluster) = shared.store.cluster()
        && let Err(error) = cluster.fold_counts().await
    {
        tracing::debug!(%error, "counts could not be added up");
    }
}

async fn sweep(shared: Arc<Shared>) {
    if let Some(cluster) = shared.store.cluster() {
        note_swept(sweep_once(&shared, cluster).await);
    }
}

/// In the database every node may look as often as it likes; what is elsewhere is listed once a day, by one of them.
async fn sweep_once(shared: &Shared, cluster: &dyn Cluster) -> Result<u64, JobsError> {
    match &shared.options.results {
        None => Ok(cluster.sweep_objects().await?),
        Some(_) if cluster.take_sweep().await? => shared.sweep_old_results().await,
        Some(_) => Ok(0),
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
