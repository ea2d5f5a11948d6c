//! What runs beside the workers: leases, deadlines, retention, blobs.
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;
use tokio::time::MissedTickBehavior;
use uuid::Uuid;

use crate::attempts::attempt::StopReason;
use crate::disk_reserve;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::{FailureKind, Job, State, too_late};
use crate::shared::{Shared, heartbeat};
use crate::storage_fault::StoragePlace;
use crate::store::{Moment, Reap, RetentionRule};
use crate::sync::blocking;

pub mod nodes;

/// Starts all of this.
pub(crate) fn start(shared: &Arc<Shared>) {
    let (longest, shortest) = SWEEP_EVERY;
    let retention = shared.options.retention.unwrap_or(longest);
    let sweep_every = (retention / 10).clamp(shortest, longest);
    every(shared, SWEEP_RESULTS_EVERY, sweep_orphans);
    every(shared, RECOVER_EVERY, recover);
    every(shared, RESERVE_EVERY, keep_reserve);
    every(shared, sweep_every, expire_jobs);
    every(shared, DEADLINE_INTERVAL, watch_deadlines);
    shared.tasks.spawn(reap_expired(shared.clone()));
    if shared.store.cluster().is_some() {
        nodes::start(shared);
    }
}

/// Does this at once, and again each time the interval has passed, until the service drains.
fn every<F>(
    shared: &Arc<Shared>,
    interval: Duration,
    work: impl Fn(Arc<Shared>) -> F + Send + Sync + 'static,
) where
    F: Future<Output = ()> + Send,
{
    let mut beat = tokio::time::interval(interval);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let shared = shared.clone();
    let draining = shared.draining.clone();
    shared.tasks.clone().spawn(async move {
        let working = async {
            loop {
                beat.tick().await;
                work(shared.clone()).await;
            }
        };
        draining.run_until_cancelled(working).await
    });
}

/// Results checked in one call by the sweep for orphans.
const SWEEP_CHUNK: usize = 500;

/// Results taken from the outbox at once.
const COLLECT_CHUNK: u32 = 500;

impl Shared {
    /// Removes large results that no job refers to any more. What cannot be removed now is tried again later.
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

/// Time between two sweeps of an embedded table.
const SWEEP_RESULTS_EVERY: Duration = Duration::from_secs(24 * 3600);

/// Removes results that no job refers to: what a process left behind that was killed between the write of a result and the end of its
/// job. The nodes of a database do so together.
async fn sweep_orphans(shared: Arc<Shared>) {
    if shared.store.cluster().is_none() {
        note_swept(shared.sweep_results().await);
    }
}

/// Notes the end of a sweep of results.
fn note_swept(removed: Result<u64>) {
    match removed {
        Ok(0) => {}
        Ok(removed) => tracing::info!(removed, "results without a job removed"),
        Err(error) => tracing::warn!(%error, "results without a job could not be swept"),
    }
}

/// Results written less long ago may be on their way to their job, in ms.
const YOUNG: i64 = 24 * 3600 * 1000;

impl Jobs {
    /// Removes results outside the table that no job refers to; returns their number. Where several nodes share a database, only results
    /// that were written more than a day ago. A running service does this by itself, once a day.
    ///
    /// # Errors
    /// The database or the place of the results failed; the next sweep will go on.
    pub async fn sweep_results(&self) -> Result<u64> {
        match self.shared.store.cluster() {
            Some(_) => self.shared.sweep_old_results().await,
            None => self.shared.sweep_results().await,
        }
    }
}

impl Shared {
    /// Removes the results of an embedded table that no job refers to; returns their number.
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

    /// Removes results outside the database that no job refers to and that were written more than a day ago; returns their number.
    /// Several nodes may do so at once.
    pub(crate) async fn sweep_old_results(&self) -> Result<u64> {
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

/// Time between two checks for jobs whose deadline has passed.
const DEADLINE_INTERVAL: Duration = Duration::from_secs(1);

/// Ends jobs whose deadline has passed: queued ones at once, running ones at the next tick of their solvers.
async fn watch_deadlines(shared: Arc<Shared>) {
    if let Err(error) = enforce_deadlines(&shared).await {
        tracing::warn!(%error, "deadlines could not be checked");
    }
}

async fn enforce_deadlines(shared: &Shared) -> Result<()> {
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

/// Takes jobs whose lease has run out from their workers, three times per lease, until the service drains.
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
        // While nothing can be written no lease can be renewed either, which is no silence of the workers.
        if shared.storage.fault(StoragePlace::Table).is_some() {
            quiet_until = shared.lease_until();
        }
        let now = shared.steady_ms();
        // If the table has held up this loop, it has held up the heartbeats of the workers as well.
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
                    if state.ended() {
                        count_taken(&shared, state);
                        shared.announce(id);
                    } else {
                        shared.wake_workers();
                    }
                }
            }
            Err(error) => tracing::warn!(%error, "expired leases could not be searched for"),
        }
    }
}

fn count_taken(shared: &Shared, state: State) {
    match state {
        State::Failed => shared.metrics.failed(FailureKind::WorkerLost),
        state => shared.metrics.ended(state, 1),
    }
}

/// Time between two tries to do what a full disk did not allow.
const RECOVER_EVERY: Duration = Duration::from_secs(1);

/// Time between two checks of the disk reserve.
const RESERVE_EVERY: Duration = Duration::from_secs(60);

/// Takes back what a dead process left, and removes what is left of batches that were given up, again and again for as
/// long as the disk does not allow it.
async fn recover(shared: Arc<Shared>) {
    if shared.recovered.get().is_none()
        && let Err(error) = shared.recover().await
    {
        tracing::warn!(%error, "jobs of a dead process cannot be returned to the queue yet");
    }
    if !shared.unfinished_batches().abandoned.is_empty() {
        shared.drop_abandoned().await;
    }
    if shared.storage.any() {
        // The outcome is noted; what fails is tried again at the next time.
        let _ = shared.require_storage().await;
    }
}

/// Keeps the disk reserve.
async fn keep_reserve(shared: Arc<Shared>) {
    if !shared.storage.any() {
        let data_dir = shared.options.data_dir.clone();
        // It is tried again at the next time.
        let _ = blocking(move || disk_reserve::keep(&data_dir)).await;
    }
}

impl Shared {
    /// Takes back the jobs that a dead process was running.
    pub(crate) async fn recover(&self) -> Result<()> {
        if self.recovered.get().is_some() {
            return Ok(());
        }
        if self.store.cluster().is_some() {
            // What runs is of other processes, as long as their leases last.
            let _ = self.recovered.set(());
            return Ok(());
        }
        let attempts_max = self.options.attempts_max;
        let taken = self
            .store
            .reap(Reap::Dead, self.now_ms(), attempts_max)
            .await;
        let taken = taken.map_err(JobsError::from);
        self.observe_storage(StoragePlace::Table, &taken);
        for (id, state) in taken? {
            tracing::info!(job = %id, state = state.name(), "job of a dead process returned to the queue");
        }
        // Set once; whoever was first is right.
        let _ = self.recovered.set(());
        if !self.unfinished_batches().abandoned.is_empty() {
            self.drop_abandoned().await;
        }
        Ok(())
    }
}

/// How long the ids of expired jobs and batches are remembered.
pub const REMEMBERED_FOR: Duration = Duration::from_secs(30 * 24 * 3600);

/// Jobs removed in one transaction.
const SWEEP_JOBS: u32 = 500;

/// Free pages of the database given back to the file system in one step.
const SHRINK_PAGES: u32 = 2000;

/// Free pages that stay in the database file for what comes next.
const SPARE_PAGES: i64 = 4000;

/// Pause between two steps, in which others may write.
const PAUSE: Duration = Duration::from_millis(20);

/// Longest and shortest time between two sweeps.
const SWEEP_EVERY: (Duration, Duration) = (Duration::from_secs(60), Duration::from_secs(1));

impl Jobs {
    /// Removes every ended job whose time is over, batches of which nothing is left, and ids remembered long enough;
    /// gives free space of the database back. Returns the number of jobs removed. A running service does this by
    /// itself.
    ///
    /// # Errors
    /// The database failed; the next sweep will go on.
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

async fn expire_jobs(shared: Arc<Shared>) {
    match shared.sweep_expired().await {
        Ok(0) => {}
        Ok(removed) => tracing::info!(removed, "expired jobs removed"),
        Err(error) => tracing::warn!(%error, "expired jobs could not be removed"),
    }
}

fn millis(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}
