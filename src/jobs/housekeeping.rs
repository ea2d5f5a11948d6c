//! What has to be done besides solving: taking jobs from silent workers, and removing results nobody owns.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::jobs::Shared;
use crate::jobs::error::JobsError;
use crate::jobs::job::{FailureKind, State};
use crate::jobs::reserve;
use crate::jobs::worker::heartbeat;

/// Jobs looked up in one statement by the sweep.
const SWEEP_CHUNK: usize = 500;
/// Time between two tries to do what a full disk did not allow.
const RECOVER_EVERY: Duration = Duration::from_secs(1);
/// Time between two looks whether there is room in reserve.
const RESERVE_EVERY: Duration = Duration::from_secs(60);
/// Results taken from the outbox at once.
const COLLECT_CHUNK: u32 = 500;

/// Takes jobs whose lease has run out from their workers, three times per lease, until the service drains.
pub(super) async fn reap_expired(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(heartbeat(&shared));
    beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let recovered = shared.recovered.wait();
    let _ = shared.draining.run_until_cancelled(recovered).await;
    let mut quiet_until = i64::MIN;
    let mut looked = shared.steady_ms();
    while shared
        .draining
        .run_until_cancelled(beat.tick())
        .await
        .is_some()
    {
        // While nothing can be written no lease can be renewed either, which is no silence of the workers.
        if shared.storage_failing.load(Ordering::Relaxed) {
            quiet_until = shared.lease_until();
        }
        let now = shared.steady_ms();
        // Who was held up by the table has held up the heartbeats of the workers as well.
        if now.saturating_sub(looked) > shared.lease_ms() * 2 / 3 {
            quiet_until = shared.lease_until();
        }
        looked = now;
        if now < quiet_until {
            continue;
        }
        let reaped = shared
            .store
            .reap(now, shared.now_ms(), shared.options.attempts_max);
        match reaped.await {
            Ok(taken) => {
                for (id, state) in taken {
                    tracing::warn!(job = %id, state = state.name(), "lease ran out, job taken back");
                    if state.ended() {
                        count_taken(&shared, state);
                        shared.announce(id);
                    } else {
                        shared.wake.notify_one();
                    }
                }
            }
            Err(error) => tracing::warn!(%error, "expired leases could not be looked for"),
        }
    }
}

/// Takes back what a dead process left, and removes what is left of batches that were given up, again and again for as
/// long as the disk does not allow it.
pub(super) async fn recover(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(RECOVER_EVERY);
    let mut reserved = tokio::time::Instant::now();
    while shared
        .draining
        .run_until_cancelled(beat.tick())
        .await
        .is_some()
    {
        if shared.recovered.get().is_none()
            && let Err(error) = shared.recover().await
        {
            tracing::warn!(%error, "jobs of a dead process cannot be taken back yet");
        }
        if !shared.underway().abandoned.is_empty() {
            shared.drop_abandoned().await;
        }
        if reserved.elapsed() >= RESERVE_EVERY && !shared.storage_failing.load(Ordering::Relaxed) {
            reserved = tokio::time::Instant::now();
            let data_dir = shared.options.data_dir.clone();
            // It is tried again at the next time.
            let _ = tokio::task::spawn_blocking(move || reserve::keep(&data_dir)).await;
        }
    }
}

impl Shared {
    /// Takes back the jobs that a dead process was running.
    pub(super) async fn recover(&self) -> Result<(), JobsError> {
        if self.recovered.get().is_some() {
            return Ok(());
        }
        let attempts_max = self.options.attempts_max;
        let taken = self.store.reap_dead(self.now_ms(), attempts_max).await;
        self.note(&taken);
        for (id, state) in taken? {
            tracing::info!(job = %id, state = state.name(), "job of a dead process taken back");
        }
        // Set once; whoever was first is right.
        let _ = self.recovered.set(());
        if !self.underway().abandoned.is_empty() {
            self.drop_abandoned().await;
        }
        Ok(())
    }
}

fn count_taken(shared: &Shared, state: State) {
    match state {
        State::Failed => shared.metrics.failed(FailureKind::WorkerLost),
        state => shared.metrics.ended(state, 1),
    }
}

impl Shared {
    /// Removes large results that nobody refers to any more; what cannot be removed now is tried again later.
    pub(super) async fn collect_blobs(&self) {
        let mut done = Vec::new();
        loop {
            let released = match self.store.released_blobs(&done, COLLECT_CHUNK).await {
                Ok(released) => released,
                Err(error) => {
                    tracing::warn!(%error, "results without a job could not be looked for");
                    return;
                }
            };
            done.clear();
            for key in released {
                match self.results.remove(&key).await {
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

/// Removes results that no job refers to and that are not on their way to one: what a process left behind that was
/// killed between the two. Runs once, beside everything else.
pub(super) async fn sweep_orphans(shared: Arc<Shared>) {
    let draining = &shared.draining;
    match draining.run_until_cancelled(sweep(&shared)).await {
        Some(Ok(0)) | None => {}
        Some(Ok(removed)) => tracing::info!(removed, "orphaned results removed"),
        Some(Err(error)) => tracing::warn!(%error, "orphaned results could not be swept"),
    }
}

async fn sweep(shared: &Shared) -> Result<usize, JobsError> {
    shared.collect_blobs().await;
    let mut removed = 0;
    for month in shared.results.months().await? {
        for some in shared.results.keys(&month).await?.chunks(SWEEP_CHUNK) {
            let (ids, keys): (Vec<_>, Vec<_>) = some.iter().cloned().unzip();
            // In this order: what a running job has written is known by its key before the job no longer runs.
            let running = shared.store.running(&ids).await?;
            let known = shared.store.known_blobs(&keys).await?;
            for (id, key) in some {
                if !running.contains(id) && !known.contains(key) {
                    shared.results.remove(key).await?;
                    removed += 1;
                }
            }
        }
    }
    Ok(removed)
}
