//! What has to be done besides solving: taking jobs from silent workers, and removing results nobody owns.

use std::sync::Arc;

use crate::jobs::Shared;
use crate::jobs::error::JobsError;
use crate::jobs::job::{FailureKind, State};
use crate::jobs::worker::heartbeat;

/// Jobs looked up in one statement by the sweep.
const SWEEP_CHUNK: usize = 500;

/// Takes jobs whose lease has run out from their workers, three times per lease, until the service drains.
pub(super) async fn reap_expired(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(heartbeat(&shared));
    while shared
        .draining
        .run_until_cancelled(beat.tick())
        .await
        .is_some()
    {
        let now = shared.now_ms();
        match shared
            .store
            .reap(now, now, shared.options.attempts_max)
            .await
        {
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

fn count_taken(shared: &Shared, state: State) {
    match state {
        State::Failed => shared.metrics.failed(FailureKind::WorkerLost),
        state => shared.metrics.ended(state, 1),
    }
}

/// Removes the results of jobs that no longer exist: what a process left behind that was killed between the removal
/// of the row and of the results. Runs once, beside everything else.
pub(super) async fn sweep_orphans(shared: Arc<Shared>) {
    match shared.draining.run_until_cancelled(sweep(&shared)).await {
        Some(Ok(0)) | None => {}
        Some(Ok(removed)) => tracing::info!(removed, "orphaned results removed"),
        Some(Err(error)) => tracing::warn!(%error, "orphaned results could not be swept"),
    }
}

async fn sweep(shared: &Shared) -> Result<usize, JobsError> {
    let mut removed = 0;
    for ids in shared.results.jobs_by_month().await? {
        for chunk in ids.chunks(SWEEP_CHUNK) {
            let existing = shared.store.existing(chunk).await?;
            for orphan in chunk.iter().filter(|id| !existing.contains(id)) {
                shared.results.remove(*orphan, None).await?;
                removed += 1;
            }
        }
    }
    Ok(removed)
}
