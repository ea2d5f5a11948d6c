//! Jobs that were claimed together, on their way through one solver thread. A single job is a group of one.
//!
//! The phases of a member ([`Phase`]); [`judge`](crate::jobs::worker::disposition) decides what follows from an outcome:
//!
//! ```text
//! Solving ─┬─ Solved(outcome) ─┬─ Store, End ──── the end is written ──────▶ Done
//!          │                   ├─ StoreSlice ─┬── next slice ──────────────▶ Solving
//!          │                   │              └── others wait: released ───▶ Done
//!          │                   ├─ Release ─────── released ────────────────▶ Done
//!          │                   └─ Discard ─────── the lease is lost ───────▶ Done
//!          ├─ NotBegun ────────────────────────── released ────────────────▶ Done
//!          └─ WaitingFor(first) ─┬─────────────── ends with its answer ────▶ Done
//!                                └─────────────── no answer: released ─────▶ Done
//! ```

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::jobs::attempts::attempt_control::{AttemptControl, StopReason};
use crate::jobs::attempts::lease::GroupLease;
use crate::jobs::attempts::outcome::Outcome;
use crate::jobs::attempts::running::RunningEntry;
use crate::jobs::attempts::slices::SlicedWork;
use crate::jobs::attempts::solver_thread::SolverThread;
use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::Claim;
use crate::jobs::store::submission::ClaimedCase;
use crate::jobs::sync::lock;

/// One claimed job.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) claim: Claim,
    pub(crate) control: Arc<AttemptControl>,
    pub(crate) phase: Phase,
    /// Its case, until it is handed to a thread.
    pub(crate) case: Option<ClaimedCase>,
    /// What it goes on with, once it is known.
    pub(crate) sliced: Option<Box<SlicedWork>>,
    pub(crate) _listed: RunningEntry,
}

/// Where a claimed job stands.
#[derive(Debug)]
pub(crate) enum Phase {
    /// It is to be solved, or is being solved.
    Solving,
    /// Its solve is over.
    Solved(Outcome),
    /// It was not begun and goes back to the queue.
    NotBegun,
    /// It is equal to this earlier job of the group and waits for its answer.
    WaitingFor(Uuid),
    /// Nothing is left to be done.
    Done,
}

/// Claimed jobs with the thread that solves them one after the other.
#[derive(Debug)]
pub(crate) struct Attempt {
    pub(crate) queue: Queue,
    pub(crate) members: Vec<Member>,
    pub(crate) lease: GroupLease,
    /// It was running when a process died; this process solves no other such job at the same time.
    pub(crate) _suspect: Option<OwnedMutexGuard<()>>,
    /// It is a sweep that had been in the queue between two of its slices.
    pub(crate) was_begun: bool,
    /// Begin of its turn.
    pub(crate) turn_began: Instant,
    /// Solver time spent on what it is at.
    pub(crate) spent: Duration,
    pub(crate) solver: Option<Solver>,
}

/// Outcomes that the thread has left for its worker, with the places of their members.
pub(crate) type Outcomes = Arc<Mutex<Vec<(usize, Outcome)>>>;

/// What comes from the thread.
#[derive(Debug)]
pub(crate) struct Solver {
    pub(crate) thread: SolverThread,
    pub(crate) outcomes: Outcomes,
    /// Set when there will be no more outcomes.
    pub(crate) over: CancellationToken,
    /// Nothing more shall be begun.
    pub(crate) closed: Arc<Mutex<bool>>,
}

impl Attempt {
    /// Has it been handed to a thread?
    pub(crate) fn begun(&self) -> bool {
        self.solver.is_some()
    }

    /// The places of the members that are to be solved.
    pub(crate) fn to_solve(&self) -> Vec<usize> {
        let members = self.members.iter().enumerate();
        let solving = members.filter(|(_, member)| matches!(member.phase, Phase::Solving));
        solving.map(|(place, _)| place).collect()
    }

    /// Takes the outcomes that there are.
    pub(crate) fn take_outcomes(&mut self) {
        if let Some(solver) = &self.solver {
            let mut outcomes = lock(&solver.outcomes);
            for (place, outcome) in outcomes.drain(..) {
                self.members[place].phase = Phase::Solved(outcome);
            }
        }
    }

    /// Set when there will be no more outcomes.
    pub(crate) fn over(&self) -> CancellationToken {
        if let Some(solver) = &self.solver {
            return solver.over.clone();
        }
        let none = CancellationToken::new();
        none.cancel();
        none
    }

    /// Nothing more is begun: what the thread has not taken up goes back to the queue.
    pub(crate) fn close(&mut self) {
        if let Some(solver) = &self.solver {
            *lock(&solver.closed) = true;
        }
        self.take_outcomes();
        for member in &mut self.members {
            let solving = member.control.is_started() && member.sliced.is_none();
            if matches!(member.phase, Phase::Solving) && !solving {
                member.phase = Phase::NotBegun;
            }
        }
    }

    /// The solver does not stop: what it is at counts as abandoned. Returns its thread, which is to be left behind.
    pub(crate) fn abandon(&mut self) -> Option<SolverThread> {
        self.close();
        for member in &mut self.members {
            if matches!(member.phase, Phase::Solving) {
                member.phase = Phase::Solved(Outcome::Abandoned);
            }
        }
        self.take_thread()
    }

    /// The thread, once it has nothing more to do.
    pub(crate) fn take_thread(&mut self) -> Option<SolverThread> {
        self.solver.take().map(|solver| solver.thread)
    }

    /// Are there members that wait behind another of this attempt? A sweep that is about to begin its next slice waits
    /// behind nobody.
    pub(crate) fn has_more_to_begin(&self) -> bool {
        let solving = self
            .members
            .iter()
            .filter(|member| matches!(member.phase, Phase::Solving));
        let waiting = solving
            .clone()
            .filter(|member| !member.control.is_started());
        solving.count() > 1 && waiting.count() > 0
    }

    /// Tells every member to stop.
    pub(crate) fn stop(&self, reason: StopReason) {
        for member in &self.members {
            member.control.stop(reason);
        }
    }

    /// The member that the solver is at, if it was cancelled or its deadline has passed.
    pub(crate) fn unwanted(&self) -> Option<usize> {
        self.members.iter().position(|member| {
            let reason = member.control.reason();
            matches!(member.phase, Phase::Solving)
                && member.control.is_started()
                && matches!(reason, Some(StopReason::Cancel | StopReason::Deadline))
        })
    }

    /// Claims of the members that are in the phase that `is` tells.
    pub(crate) fn claims(&self, is: impl Fn(&Phase) -> bool) -> Vec<Claim> {
        let members = self.members.iter().filter(|member| is(&member.phase));
        members.map(|member| member.claim.clone()).collect()
    }

    /// Members with these ids need nothing more.
    pub(crate) fn done(&mut self, ids: &[Uuid]) {
        self.lease.let_go(ids);
        for member in &mut self.members {
            if ids.contains(&member.claim.id) {
                member.phase = Phase::Done;
            }
        }
    }

    /// Members equal to an earlier one wait for its answer.
    pub(crate) fn set_aside_duplicates(&mut self) {
        let mut firsts = HashMap::new();
        for member in &mut self.members {
            let Some(key) = member.claim.cache_key else {
                continue;
            };
            if !matches!(member.phase, Phase::Solving) {
                continue;
            }
            let first = *firsts.entry(key).or_insert(member.claim.id);
            if first != member.claim.id {
                member.phase = Phase::WaitingFor(first);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::attempts::lease::HeldLeases;
    use crate::jobs::attempts::running::RunningAttempts;
    use crate::jobs::model::kind::Kind;

    fn attempt(jobs: u32) -> Attempt {
        let claim = || Claim {
            id: Uuid::now_v7(),
            attempt: 1,
            lease_token: 1,
            method: "auto".to_owned(),
            traceparent: None,
            cache_key: None,
            suspect: false,
            slices: 0,
        };
        let member = |claim: Claim| {
            let control = Arc::new(AttemptControl::default());
            Member {
                _listed: RunningAttempts::default().enter(claim.id, &control),
                claim,
                control,
                phase: Phase::Solving,
                case: None,
                sliced: None,
            }
        };
        Attempt {
            queue: Queue {
                tenant: "t".into(),
                kind: Kind::Case,
            },
            members: (0..jobs).map(|_| member(claim())).collect(),
            lease: GroupLease(Arc::new(HeldLeases::new(Vec::new(), 0))),
            _suspect: None,
            was_begun: false,
            turn_began: Instant::now(),
            spent: Duration::ZERO,
            solver: None,
        }
    }

    #[tokio::test]
    async fn a_sweep_between_two_slices_waits_behind_nobody() {
        let alone = attempt(1);
        assert!(
            !alone.has_more_to_begin(),
            "its thread has yet to come to it"
        );
        let group = attempt(2);
        group.members[0].control.take_up();
        assert!(group.has_more_to_begin());
        group.members[1].control.take_up();
        assert!(!group.has_more_to_begin());
    }
}
