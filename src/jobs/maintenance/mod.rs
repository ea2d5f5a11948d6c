//! Periodic tasks: expired leases, deadlines, expired jobs and orphaned results.
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;
use tokio::time::MissedTickBehavior;
use uuid::Uuid;

use crate::attempts::attempt::StopReason;
use crate::data_dir;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::{FailureKind, Job, State, too_late};
use crate::shared::{Shared, heartbeat};
use crate::storage_fault::StoragePlace;
use crate::store::{Moment, Reap, RetentionRule};
use crate::sync::{blocking, lock};

pub mod nodes;

/// Starts the periodic tasks.
pub(crate) fn start(shared: &Arc<Shared>) {
    let (longest, shortest) = SWEEP_EVERY;
    let retention = shared.options.retention.unwrap_or(longest);
    let sweep_every = (retention / 10).clamp(shortest, longest);
    let sweep_results_every = match shared.store.cluster() {
        Some(_) => SWEEP_RESULTS_EVERY.1,
        None => SWEEP_RESULTS_EVERY.0,
    };
    let failed = "results without a job could not be swept";
    every(shared, sweep_results_every, failed, sweep_orphans);
    let failed = "jobs of a dead process cannot be returned to the queue yet";
    every(shared, RECOVER_EVERY, failed, recover);
    let failed = "the disk reserve could not be kept";
    every(shared, RESERVE_EVERY, failed, keep_reserve);
    let failed = "expired jobs could not be removed";
    every(shared, sweep_every, failed, expire_jobs);
    let failed = "deadlines could not be checked";
    every(shared, DEADLINE_INTERVAL, failed, enforce_deadlines);
    shared.tasks.spawn(reap_expired(shared.clone()));
    if shared.store.cluster().is_some() {
        nodes::start(shared);
    }
}

/// Runs a task at once and then at each interval, until the service drains. A failure is logged with the text `failed`.
fn every<F>(
    shared: &Arc<Shared>,
    interval: Duration,
    failed: &'static str,
    work: impl Fn(Arc<Shared>) -> F + Send + Sync + 'static,
) where
    F: Future<Output = Result<()>> + Send,
{
    let mut beat = tokio::time::interval(interval);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let shared = shared.clone();
    let draining = shared.draining.clone();
    shared.tasks.clone().spawn(async move {
        let working = async {
            loop {
                beat.tick().await;
                if let Err(error) = work(shared.clone()).await {
                    tracing::warn!(%error, "{failed}");
                }
            }
        };
        draining.run_until_cancelled(working).await
    });
}

/// Number of results checked in one call by the sweep of orphans.
const SWEEP_CHUNK: usize = 500;

/// Number of results removed in one round.
const COLLECT_CHUNK: u32 = 500;

impl Shared {
    /// Removes results that no job refers to. Failed removals are repeated later.
    pub(crate) async fn collect_blobs(&self) {
        let mut done = Vec::new();
        loop {
            let released = match self.store.released_blobs(&done, COLLECT_CHUNK).await {
                Ok(released) => released,
                Err(error) => {
                    tracing::warn!(%error, "results without a job could not be searched for");
                    return;
                }
            };
            done.clear();
            for key in released {
                match self.blobs.remove(&key).await {
                    Ok(()) => done.push(key),
                    Err(error) => {
                        tracing::warn!(key, %error, "a result without a job could not be removed yet");
                    }
                }
            }
            if done.is_empty() {
                return;
            }
        }
    }
}

/// Interval between two sweeps of orphaned results on one machine, and in a cluster.
const SWEEP_RESULTS_EVERY: (Duration, Duration) =
    (Duration::from_secs(24 * 3600), Duration::from_secs(3600));

/// Removes results that no job refers to, which a process leaves that is killed between the write of a result and the end
/// of its job. Results in a shared database are swept each time; results in a shared store once a day, by one node.
async fn sweep_orphans(shared: Arc<Shared>) -> Result<()> {
    let removed = match (shared.store.cluster(), &shared.options.results) {
        (None, _) => shared.sweep_results().await?,
        (Some(cluster), None) => cluster.sweep_objects().await?,
        (Some(cluster), Some(_)) if cluster.take_sweep().await? => {
            shared.sweep_old_results().await?
        }
        _ => 0,
    };
    if removed > 0 {
        tracing::info!(removed, "results without a job removed");
    }
    Ok(())
}

/// Minimum age in ms of a result without a job before it counts as an orphan: its job may be about to end.
const YOUNG: i64 = 24 * 3600 * 1000;

impl Jobs {
    /// Removes results outside the table that no job refers to; returns their number. With a shared database, only results
    /// older than a day are removed. A running service does this once a day.
    ///
    /// # Errors
    /// The database or the store of results failed; the next sweep continues.
    pub async fn sweep_results(&self) -> Result<u64> {
        match self.shared.store.cluster() {
            Some(_) => self.shared.sweep_old_results().await,
            None => self.shared.sweep_results().await,
        }
    }
}

impl Shared {
    /// Removes the orphans of an embedded table; returns their number.
    async fn sweep_results(&self) -> Result<u64> {
        self.collect_blobs().await;
        let mut removed = 0;
        for month in self.blobs.months().await? {
            for some in self.blobs.keys(&month).await?.chunks(SWEEP_CHUNK) {
                removed += self.remove_orphans(some).await?;
            }
        }
        Ok(removed)
    }

    async fn remove_orphans(&self, results: &[(Uuid, String)]) -> Result<u64> {
        let orphans = self.store.orphans(results).await?;
        for key in &orphans {
            self.blobs.remove(key).await?;
            self.metrics.results_swept.inc();
        }
        Ok(orphans.len() as u64)
    }

    /// Removes orphans outside the database that are older than a day; returns their number. Several nodes may do so at once.
    async fn sweep_old_results(&self) -> Result<u64> {
        let before = self.now_ms() - YOUNG;
        let mut listed = self.blobs.listed();
        let (mut some, mut removed) = (Vec::new(), 0);
        loop {
            let next = listed.try_next().await?;
            let last = next.is_none();
            if let Some((job, key, written)) = next
                && written < before
                && some.last().is_none_or(|(_, known)| *known != key)
            {
                some.push((job, key));
            }
            if some.len() >= SWEEP_CHUNK || last {
                removed += self.remove_orphans(&some).await?;
                some.clear();
            }
            if last {
                return Ok(removed);
            }
        }
    }
}

/// Interval between two checks of the deadlines.
const DEADLINE_INTERVAL: Duration = Duration::from_secs(1);

/// Ends jobs whose deadline has passed: queued ones at once, running ones at the next tick of their solvers.
async fn enforce_deadlines(shared: Arc<Shared>) -> Result<()> {
    let (now, leap) = (shared.now_ms(), shared.clock_step());
    let moment = Moment {
        now,
        set_at: leap.at,
        unset: now.saturating_sub(leap.ms),
    };
    let failure = too_late();
    loop {
        let overdue = shared.store.pass_deadlines(&failure, moment).await?;
        for id in &overdue.ended {
            tracing::info!(job = %id, "deadline passed, job ended");
            shared.metrics.failed(FailureKind::DeadlinePassed);
            shared.announce(*id);
        }
        if overdue.ended.is_empty() {
            for id in overdue.running {
                shared.leases.stop(id, StopReason::Deadline);
            }
            break;
        }
    }
    Ok(())
}

/// Takes jobs with expired leases from their workers, three times per lease, until the service drains.
async fn reap_expired(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(heartbeat(&shared));
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let recovered = shared.recovered.wait();
    let _ = shared.draining.run_until_cancelled(recovered).await;
    let mut quiet_until = i64::MIN;
    let mut checked_at = shared.steady_ms();
    while shared
        .draining
        .run_until_cancelled(beat.tick())
        .await
        .is_some()
    {
        // While nothing can be written, leases cannot be renewed either, which is not the fault of the workers.
        if shared.storage.fault(StoragePlace::Table).is_some() {
            quiet_until = shared.lease_until();
        }
        let now = shared.steady_ms();
        // A table that delayed this loop has also delayed the heartbeats of the workers.
        if now.saturating_sub(checked_at) > shared.lease_ms() * 2 / 3 {
            quiet_until = shared.lease_until();
        }
        checked_at = now;
        if now < quiet_until {
            continue;
        }
        let reaped = shared.store.reap(
            Reap::Expired { now },
            shared.now_ms(),
            shared.options.attempts_max,
        );
        match reaped.await {
            Ok(taken) => {
                for (id, state) in taken {
                    tracing::warn!(job = %id, state = state.name(), "lease expired, job returned to the queue");
                    match state {
                        State::Failed => shared.metrics.failed(FailureKind::WorkerLost),
                        state if state.ended() => shared.metrics.ended(state, 1),
                        _ => {
                            shared.wake_workers();
                            continue;
                        }
                    }
                    shared.announce(id);
                }
            }
            Err(error) => tracing::warn!(%error, "expired leases could not be searched for"),
        }
    }
}

/// Interval between two attempts to recover from a storage fault.
const RECOVER_EVERY: Duration = Duration::from_secs(1);

/// Interval between two checks of the disk reserve.
const RESERVE_EVERY: Duration = Duration::from_secs(60);

/// Returns the jobs of a crashed process to the queue, and removes abandoned batches, until storage permits it.
async fn recover(shared: Arc<Shared>) -> Result<()> {
    if shared.storage.any() {
        // The outcome is recorded; a failure is repeated at the next interval.
        let _ = shared.require_storage().await;
    }
    shared.recover().await
}

/// Creates the disk reserve again if it is missing.
async fn keep_reserve(shared: Arc<Shared>) -> Result<()> {
    if shared.storage.any() {
        return Ok(());
    }
    let data_dir = shared.options.data_dir.clone();
    blocking(move || data_dir::keep_reserve(&data_dir)).await
}

impl Shared {
    /// Returns the jobs of a crashed process to the queue, and removes abandoned batches. In a cluster, running jobs belong
    /// to other processes while their leases last.
    pub(crate) async fn recover(&self) -> Result<()> {
        if self.recovered.get().is_none() && self.store.cluster().is_none() {
            let attempts_max = self.options.attempts_max;
            let taken = self.store.reap(Reap::Dead, self.now_ms(), attempts_max);
            let taken = taken.await.map_err(JobsError::from);
            self.observe_storage(StoragePlace::Table, &taken);
            for (id, state) in taken? {
                tracing::info!(job = %id, state = state.name(), "job of a dead process returned to the queue");
            }
        }
        // An error means that it is set already.
        let _ = self.recovered.set(());
        if !lock(&self.batches).abandoned.is_empty() {
            self.drop_abandoned().await;
        }
        Ok(())
    }
}

/// How long the ids of expired jobs and batches are remembered.
pub const REMEMBERED_FOR: Duration = Duration::from_secs(30 * 24 * 3600);

/// Number of jobs removed in one transaction.
const SWEEP_JOBS: u32 = 500;

/// Number of free database pages returned to the file system in one step.
const SHRINK_PAGES: u32 = 2000;

/// Number of free pages that remain in the database file.
const SPARE_PAGES: i64 = 4000;

/// Pause between two steps, for other writers.
const PAUSE: Duration = Duration::from_millis(20);

/// Longest and shortest interval between two sweeps of expired jobs.
const SWEEP_EVERY: (Duration, Duration) = (Duration::from_secs(60), Duration::from_secs(1));

impl Jobs {
    /// Removes expired jobs, empty batches, and ids that were remembered long enough; returns free space of the database to
    /// the file system. Returns the number of jobs removed. A running service does this periodically.
    ///
    /// # Errors
    /// The database failed; the next sweep continues.
    pub async fn sweep_expired(&self) -> Result<u64> {
        self.shared.sweep_expired().await
    }
}

impl Shared {
    pub(crate) fn expires_at(&self, job: &Job) -> Option<i64> {
        let kept = millis(self.options.retention?);
        job.ended_at.map(|ended| ended.saturating_add(kept))
    }

    async fn sweep_expired(&self) -> Result<u64> {
        let now = self.now_ms();
        let mut removed = 0;
        let clock_leapt = self.clock_step().ms > 0;
        if clock_leapt {
            tracing::warn!("the clock was set forward; nothing is removed before the next start");
        }
        if let Some(retention) = self.options.retention.filter(|_| !clock_leapt) {
            let expiry = RetentionRule {
                now,
                ended_before: now.saturating_sub(millis(retention)),
                forget_before: now.saturating_sub(millis(REMEMBERED_FOR)),
                jobs: SWEEP_JOBS,
            };
            loop {
                let expired = self.store.expire(expiry).await?;
                removed += expired;
                if expired < u64::from(SWEEP_JOBS) {
                    break;
                }
                tokio::time::sleep(PAUSE).await;
            }
        }
        self.collect_blobs().await;
        while self.store.compact(SPARE_PAGES, SHRINK_PAGES).await? {
            tokio::time::sleep(PAUSE).await;
        }
        Ok(removed)
    }
}

async fn expire_jobs(shared: Arc<Shared>) -> Result<()> {
    let removed = shared.sweep_expired().await?;
    if removed > 0 {
        tracing::info!(removed, "expired jobs removed");
    }
    Ok(())
}

fn millis(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}
