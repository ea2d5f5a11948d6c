//! The leases that an attempt holds, from the claim until its end is written, and whether they are to be renewed.
//!
//! While a solver works the leases are renewed only if it ticks: a heartbeat shall prove that the solver moves, not that
//! the process lives. While it waits for its turn, and while results are stored, there is nothing to tick, and the leases
//! are renewed all the same. A worker gives up by the process' own clock before the table would give its jobs away.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, Weak};

use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::store::claim::Claim;
use crate::jobs::sync::lock;

/// The leases of an attempt. They are no longer renewed once this is dropped.
#[derive(Debug)]
pub(crate) struct GroupLease(pub(crate) Arc<HeldLeases>);

#[derive(Debug)]
pub(crate) struct HeldLeases {
    leases: Mutex<Vec<(Claim, Arc<AttemptControl>)>>,
    /// A solver works and has to tick.
    pub(crate) solving: AtomicBool,
    /// Solves that ended: each is a sign of life like a tick.
    solved: AtomicU64,
    /// Ticks at the last renewal.
    pub(crate) seen: AtomicU64,
    /// When the leases run out, by the steady clock in ms.
    pub(crate) until: AtomicI64,
    /// The leases are over because the solver stands still.
    pub(crate) lost: CancellationToken,
}

/// All leases that this process holds, for its heartbeat.
#[derive(Debug, Default)]
pub(crate) struct AllLeases(Mutex<Vec<Weak<HeldLeases>>>);

impl AllLeases {
    /// Adds the leases of an attempt until it is over.
    pub(crate) fn add(&self, held: &Arc<HeldLeases>) {
        self.lock().push(Arc::downgrade(held));
    }

    /// Those that are still held.
    pub(crate) fn held(&self) -> Vec<Arc<HeldLeases>> {
        let mut all = self.lock();
        all.retain(|held| held.strong_count() > 0);
        all.iter().filter_map(Weak::upgrade).collect()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Weak<HeldLeases>>> {
        lock(&self.0)
    }
}

impl GroupLease {
    /// From now on a solver has to tick, or need not.
    pub(crate) fn solving(&self, solving: bool) {
        self.0.solving.store(solving, Ordering::Release);
    }

    /// These jobs are no longer held: they ended or were given back.
    pub(crate) fn let_go(&self, ids: &[Uuid]) {
        self.0
            .leases()
            .retain(|(claim, _)| !ids.contains(&claim.id));
    }

    /// Set once the leases are over because the solver stands still.
    pub(crate) fn lost(&self) -> &CancellationToken {
        &self.0.lost
    }
}

impl Drop for GroupLease {
    fn drop(&mut self) {
        // A solver thread that was left behind may keep the rest.
        self.0.leases().clear();
    }
}

impl HeldLeases {
    /// Leases of jobs that were claimed just now.
    pub(crate) fn new(leases: Vec<(Claim, Arc<AttemptControl>)>, until: i64) -> HeldLeases {
        HeldLeases {
            leases: Mutex::new(leases),
            solving: AtomicBool::new(false),
            solved: AtomicU64::new(0),
            seen: AtomicU64::new(0),
            until: AtomicI64::new(until),
            lost: CancellationToken::new(),
        }
    }

    /// A solve has ended.
    pub(crate) fn alive(&self) {
        self.solved.fetch_add(1, Ordering::AcqRel);
    }

    pub(crate) fn leases(&self) -> MutexGuard<'_, Vec<(Claim, Arc<AttemptControl>)>> {
        lock(&self.leases)
    }

    pub(crate) fn ticks(&self) -> u64 {
        let ticks: u64 = self
            .leases()
            .iter()
            .map(|(_, control)| control.ticks())
            .sum();
        ticks + self.solved.load(Ordering::Acquire)
    }
}
