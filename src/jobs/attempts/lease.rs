//! The leases that an attempt holds, from the claim until its end is written, and whether they are to be renewed.
//!
//! While a solver works the leases are renewed only if it ticks: a heartbeat shall prove that the solver moves, not that
//! the process lives. While it waits for its turn, and while results are stored, there is nothing to tick, and the leases
//! are renewed all the same. A worker gives up by the process' own clock before the table would give its jobs away.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::task::AbortHandle;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::store::claim::Claim;

/// The heartbeat of some claimed jobs; it ends when this is dropped.
#[derive(Debug)]
pub(crate) struct GroupLease {
    held: Arc<HeldLeases>,
    heartbeat: AbortHandle,
}

#[derive(Debug)]
pub(crate) struct HeldLeases {
    leases: Mutex<Vec<(Claim, Arc<AttemptControl>)>>,
    /// A solver works and has to tick.
    pub(crate) solving: AtomicBool,
    /// Jobs begun: each is a sign of life like a tick.
    begun: AtomicU64,
    /// The leases are over because the solver stands still.
    pub(crate) lost: CancellationToken,
}

impl GroupLease {
    /// The leases that this heartbeat renews.
    pub(crate) fn new(held: Arc<HeldLeases>, heartbeat: AbortHandle) -> GroupLease {
        GroupLease { held, heartbeat }
    }

    /// From now on a solver has to tick, or need not.
    pub(crate) fn solving(&self, solving: bool) {
        self.held.solving.store(solving, Ordering::Release);
    }

    /// A job was begun.
    pub(crate) fn alive(&self) {
        self.held.begun.fetch_add(1, Ordering::AcqRel);
    }

    /// These jobs are no longer held: they ended or were given back.
    pub(crate) fn let_go(&self, ids: &[Uuid]) {
        self.held
            .leases()
            .retain(|(claim, _)| !ids.contains(&claim.id));
    }

    /// Set once the leases are over because the solver stands still.
    pub(crate) fn lost(&self) -> &CancellationToken {
        &self.held.lost
    }
}

impl Drop for GroupLease {
    fn drop(&mut self) {
        self.heartbeat.abort();
    }
}

impl HeldLeases {
    /// Leases of jobs that were claimed just now.
    pub(crate) fn new(leases: Vec<(Claim, Arc<AttemptControl>)>) -> HeldLeases {
        HeldLeases {
            leases: Mutex::new(leases),
            solving: AtomicBool::new(false),
            begun: AtomicU64::new(0),
            lost: CancellationToken::new(),
        }
    }

    pub(crate) fn leases(&self) -> MutexGuard<'_, Vec<(Claim, Arc<AttemptControl>)>> {
        self.leases.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn ticks(&self) -> u64 {
        let ticks: u64 = self
            .leases()
            .iter()
            .map(|(_, control)| control.ticks())
            .sum();
        ticks + self.begun.load(Ordering::Acquire)
    }
}
