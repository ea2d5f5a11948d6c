//! Renews the leases of an attempt while its solver ticks.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use tokio::time::{Instant, MissedTickBehavior, interval_at};

use crate::jobs::attempts::attempt_control::{AttemptControl, StopReason};
use crate::jobs::attempts::lease::{GroupLease, HeldLeases};
use crate::jobs::shared::{Shared, heartbeat};
use crate::jobs::store::claim::{Claim, Renewal};

/// Starts the heartbeat of jobs that were claimed just now.
pub(crate) fn start(shared: &Arc<Shared>, leases: Vec<(Claim, Arc<AttemptControl>)>) -> GroupLease {
    let held = Arc::new(HeldLeases::new(leases));
    let heartbeat = tokio::spawn(beat(shared.clone(), held.clone())).abort_handle();
    GroupLease::new(held, heartbeat)
}

async fn beat(shared: Arc<Shared>, kept: Arc<HeldLeases>) {
    let period = heartbeat(&shared);
    let mut beat = interval_at(Instant::now() + period, period);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let lease_ms = shared.lease_ms();
    let mut until = shared.steady_ms().saturating_add(lease_ms);
    let mut seen = 0;
    loop {
        beat.tick().await;
        let held: Vec<_> = kept.leases().clone();
        let ticks = kept.ticks();
        let moves = ticks != seen || !kept.solving.load(Ordering::Acquire);
        let now = shared.steady_ms();
        if moves && !held.is_empty() {
            let beats: Vec<_> = held
                .iter()
                .map(|(claim, control)| (claim, control.progress()))
                .collect();
            match shared.store.renew(&beats, shared.lease()).await {
                Ok(renewals) => {
                    seen = ticks;
                    until = now.saturating_add(lease_ms);
                    for ((_, control), renewal) in held.iter().zip(renewals) {
                        match renewal {
                            Renewal::Held {
                                cancel_requested: true,
                            } => control.stop(StopReason::Cancel),
                            Renewal::Held { .. } => {}
                            Renewal::Lost => control.stop(StopReason::Lost),
                        }
                    }
                }
                Err(error) => {
                    tracing::warn!(%error, "leases could not be renewed");
                    if error.storage_fault().is_some() {
                        // While nothing can be written, the reaper cannot give the jobs away either.
                        seen = ticks;
                        until = now.saturating_add(lease_ms);
                    }
                }
            }
        }
        if now >= until && kept.solving.load(Ordering::Acquire) {
            for (_, control) in &held {
                control.stop(StopReason::Lost);
            }
            kept.lost.cancel();
        }
    }
}
