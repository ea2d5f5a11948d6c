//! Heartbeat: renews the leases of this process while its solvers tick.

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, Weak};

use futures_util::future::join_all;
use tokio::time::sleep;

use crate::attempts::attempt::{AttemptControl, GroupLease, HeldLeases, StopReason};
use crate::shared::{Shared, heartbeat};
use crate::store::Claim;

/// Holds the leases of newly claimed jobs and renews them.
pub(crate) fn keep(shared: &Arc<Shared>, leases: Vec<(Claim, Arc<AttemptControl>)>) -> GroupLease {
    let held = Arc::new(HeldLeases {
        leases: Mutex::new(leases),
        until: AtomicI64::new(shared.lease_until()),
        ..HeldLeases::default()
    });
    shared.leases.add(&held);
    shared.heartbeat.get_or_init(|| {
        tokio::spawn(beat(Arc::downgrade(shared)));
    });
    GroupLease(held)
}

/// Renews all leases; one task for the process, because most attempts end before their first renewal.
async fn beat(shared: Weak<Shared>) {
    while let Some(period) = shared.upgrade().map(|shared| heartbeat(&shared)) {
        sleep(period).await;
        if let Some(shared) = shared.upgrade() {
            let all = shared.leases.held();
            join_all(all.iter().map(|held| renew(&shared, held))).await;
        }
    }
}

async fn renew(shared: &Shared, kept: &HeldLeases) {
    let held: Vec<_> = kept.leases().clone();
    let ticks = kept.ticks();
    let solving = || kept.solving.load(Ordering::Acquire);
    let moves = ticks != kept.seen.load(Ordering::Acquire) || !solving();
    let now = shared.steady_ms();
    if moves && !held.is_empty() {
        let beats: Vec<_> = held
            .iter()
            .map(|(claim, control)| (claim, control.progress()))
            .collect();
        let renewed = shared.store.renew(&beats, shared.lease()).await;
        let renewed = renewed.inspect_err(|error| {
            tracing::warn!(%error, "leases could not be renewed");
        });
        // While the store rejects writes, the reaper cannot take the jobs either.
        if renewed
            .as_ref()
            .map_or_else(|error| error.storage_fault().is_some(), |_| true)
        {
            kept.seen.store(ticks, Ordering::Release);
            let until = now.saturating_add(shared.lease_ms());
            kept.until.store(until, Ordering::Release);
        }
        if let Ok(renewed) = renewed {
            let lost = held
                .iter()
                .filter(|(claim, _)| !renewed.contains(&claim.id));
            lost.for_each(|(_, control)| control.stop(StopReason::Lost));
        }
    }
    if now >= kept.until.load(Ordering::Acquire) && solving() {
        for (_, control) in &held {
            control.stop(StopReason::Lost);
        }
        kept.lost.cancel();
    }
}
