//! Takes jobs from workers whose lease has run out.

use std::sync::Arc;

use crate::jobs::model::job::{FailureKind, State};
use crate::jobs::shared::{Shared, heartbeat};
use crate::jobs::storage_fault::StoragePlace;
use crate::jobs::store::claim::Reap;

/// Takes jobs whose lease has run out from their workers, three times per lease, until the service drains.
pub(crate) async fn reap_expired(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(heartbeat(&shared));
    beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
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
                    tracing::warn!(job = %id, state = state.name(), "lease ran out, job taken back");
                    if state.ended() {
                        count_taken(&shared, state);
                        shared.announce(id);
                    } else {
                        shared.wake_workers();
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
