//! The heartbeat of an attempt: from the claim until its end is written.
//!
//! While a solver works the leases are renewed only if it ticks: a heartbeat shall prove that the solver moves, not that
//! the process lives. While it waits for its turn, and while results are stored, there is nothing to tick, and the leases
//! are renewed all the same. A worker gives up by the process' own clock before the table would give its jobs away.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::task::AbortHandle;
use tokio::time::{MissedTickBehavior, interval};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::jobs::Shared;
use crate::jobs::store::{Claim, Renewal};
use crate::jobs::watch::{Reason, Watch};
use crate::jobs::worker::heartbeat;

/// The heartbeat of some claimed jobs; it ends when this is dropped.
#[derive(Debug)]
pub(super) struct Keeper {
    kept: Arc<Kept>,
    task: AbortHandle,
}

#[derive(Debug)]
struct Kept {
    held: Mutex<Vec<(Claim, Arc<Watch>)>>,
    /// A solver works and has to tick.
    solving: AtomicBool,
    /// Jobs begun: each is a sign of life like a tick.
    begun: AtomicU64,
    /// The leases are over because the solver stands still.
    lost: CancellationToken,
}

impl Keeper {
    /// Starts the heartbeat of jobs that were claimed just now.
    pub(super) fn start(shared: &Arc<Shared>, held: Vec<(Claim, Arc<Watch>)>) -> Keeper {
        let kept = Arc::new(Kept {
            held: Mutex::new(held),
            solving: AtomicBool::new(false),
            begun: AtomicU64::new(0),
            lost: CancellationToken::new(),
        });
        let task = tokio::spawn(beat(shared.clone(), kept.clone())).abort_handle();
        Keeper { kept, task }
    }

    /// From now on a solver has to tick, or need not.
    pub(super) fn solving(&self, solving: bool) {
        self.kept.solving.store(solving, Ordering::Release);
    }

    /// A job was begun.
    pub(super) fn alive(&self) {
        self.kept.begun.fetch_add(1, Ordering::AcqRel);
    }

    /// These jobs are no longer held: they ended or were given back.
    pub(super) fn let_go(&self, ids: &[Uuid]) {
        self.kept
            .held()
            .retain(|(claim, _)| !ids.contains(&claim.id));
    }

    /// Set once the leases are over because the solver stands still.
    pub(super) fn lost(&self) -> &CancellationToken {
        &self.kept.lost
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Kept {
    fn held(&self) -> MutexGuard<'_, Vec<(Claim, Arc<Watch>)>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ticks(&self) -> u64 {
        let ticks: u64 = self.held().iter().map(|(_, watch)| watch.ticks()).sum();
        ticks + self.begun.load(Ordering::Acquire)
    }
}

async fn beat(shared: Arc<Shared>, kept: Arc<Kept>) {
    let mut beat = interval(heartbeat(&shared));
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let lease_ms = shared.lease_ms();
    let mut until = shared.steady_ms().saturating_add(lease_ms);
    let mut seen = 0;
    loop {
        beat.tick().await;
        let held: Vec<_> = kept.held().clone();
        let ticks = kept.ticks();
        let moves = ticks != seen || !kept.solving.load(Ordering::Acquire);
        let now = shared.steady_ms();
        if moves && !held.is_empty() {
            let beats: Vec<_> = held
                .iter()
                .map(|(claim, watch)| (claim, watch.progress()))
                .collect();
            let renewed = shared.store.renew(&beats, now.saturating_add(lease_ms));
            match renewed.await {
                Ok(renewals) => {
                    seen = ticks;
                    until = now.saturating_add(lease_ms);
                    for ((_, watch), renewal) in held.iter().zip(renewals) {
                        match renewal {
                            Renewal::Held {
                                cancel_requested: true,
                            } => watch.stop(Reason::Cancel),
                            Renewal::Held { .. } => {}
                            Renewal::Lost => watch.stop(Reason::Lost),
                        }
                    }
                }
                Err(error) => {
                    tracing::warn!(%error, "leases could not be renewed");
                    if error.trouble().is_some() {
                        // What cannot be written cannot give the jobs away either.
                        seen = ticks;
                        until = now.saturating_add(lease_ms);
                    }
                }
            }
        }
        if now >= until && kept.solving.load(Ordering::Acquire) {
            for (_, watch) in &held {
                watch.stop(Reason::Lost);
            }
            kept.lost.cancel();
        }
    }
}
