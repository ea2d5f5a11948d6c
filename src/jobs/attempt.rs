//! Jobs that were claimed together, on their way through one solver thread. A single job is a group of one.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use uuid::Uuid;

use crate::jobs::Shared;
use crate::jobs::gate::Gate;
use crate::jobs::job::{Failure, FailureKind};
use crate::jobs::keeper::Keeper;
use crate::jobs::solver_thread::{Outcome, SolverThread, Task, Work, solve_guarded};
use crate::jobs::store::Claim;
use crate::jobs::sweep::Sweep;
use crate::jobs::trace::Traced;
use crate::jobs::turns::Spent;
use crate::jobs::watch::{Reason, Watch};

/// A group that takes longer hands back what it has not begun.
const GROUP_TIME: Duration = Duration::from_millis(400);

/// One claimed job.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) claim: Claim,
    pub(super) watch: Arc<Watch>,
    pub(super) phase: Phase,
    /// What it goes on with, once it is known.
    pub(super) sweep: Option<Box<Sweep>>,
    _registered: Registered,
}

/// Where a claimed job stands.
#[derive(Debug)]
pub(super) enum Phase {
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
pub(super) struct Attempt {
    pub(super) tenant: Arc<str>,
    pub(super) members: Vec<Member>,
    pub(super) keeper: Keeper,
    pub(super) gate: Arc<Gate>,
    /// It was running when a process died, and is solved while nothing else is.
    pub(super) suspect: bool,
    /// What its time is spent on.
    pub(super) on: Spent,
    /// Begin of its turn.
    pub(super) turn_began: Instant,
    /// Solver time spent on what it is at.
    pub(super) spent: Duration,
    solver: Option<Solver>,
}

/// What comes from the thread.
#[derive(Debug)]
struct Solver {
    thread: SolverThread,
    outcomes: UnboundedReceiver<(usize, Outcome)>,
    /// Nothing more shall be begun.
    closed: Arc<AtomicBool>,
}

impl Attempt {
    /// Takes note of claimed jobs and keeps their leases from now on.
    pub(super) fn new(shared: &Arc<Shared>, tenant: Arc<str>, claims: Vec<Claim>) -> Attempt {
        let gate = Arc::new(Gate::default());
        let suspect = claims.iter().any(|claim| claim.suspect);
        let on = match claims.iter().any(|claim| claim.slices > 0) {
            true => Spent::Begun,
            false => Spent::New,
        };
        let members: Vec<Member> = claims
            .into_iter()
            .map(|claim| {
                let watch = Arc::new(Watch::new(gate.clone()));
                Member {
                    _registered: Registered::new(shared, claim.id, &watch),
                    claim,
                    watch,
                    phase: Phase::Solving,
                    sweep: None,
                }
            })
            .collect();
        let held = members
            .iter()
            .map(|one| (one.claim.clone(), one.watch.clone()));
        Attempt {
            tenant,
            keeper: Keeper::start(shared, held.collect()),
            members,
            gate,
            suspect,
            on,
            turn_began: Instant::now(),
            spent: Duration::ZERO,
            solver: None,
        }
    }

    /// Has it been handed to a thread?
    pub(super) fn begun(&self) -> bool {
        self.solver.is_some()
    }

    /// The places of the members that are to be solved.
    pub(super) fn to_solve(&self) -> Vec<usize> {
        let members = self.members.iter().enumerate();
        let solving = members.filter(|(_, member)| matches!(member.phase, Phase::Solving));
        solving.map(|(place, _)| place).collect()
    }

    /// Hands the work for the members at these places to a thread.
    pub(super) fn begin(
        &mut self,
        shared: &Arc<Shared>,
        thread: SolverThread,
        work: Vec<(usize, Work)>,
    ) {
        self.spent = Duration::ZERO;
        let (reply, outcomes) = unbounded_channel();
        let closed = Arc::new(AtomicBool::new(false));
        let work: Vec<_> = work
            .into_iter()
            .map(|(place, work)| {
                let member = &self.members[place];
                member.watch.set_aside();
                let traced = shared.traced(&member.claim);
                (place, member.watch.clone(), work, traced)
            })
            .collect();
        let task: Task = {
            let (shared, closed) = (shared.clone(), closed.clone());
            Box::new(move || {
                let start = Instant::now();
                for (number, (place, watch, work, traced)) in work.into_iter().enumerate() {
                    let late = number > 0 && start.elapsed() > GROUP_TIME;
                    if late || closed.load(Ordering::Acquire) || shared.stopping.is_cancelled() {
                        break;
                    }
                    watch.take_up();
                    let from_queue = matches!(work, Work::New(..));
                    let solve = || solve_guarded(&shared, &watch, work);
                    let outcome = Traced::solving(traced.as_ref(), from_queue, solve);
                    // An abandoned attempt has nobody listening.
                    let _ = reply.send((place, outcome));
                }
            })
        };
        if thread.give(task) {
            self.solver = Some(Solver {
                thread,
                outcomes,
                closed,
            });
            return;
        }
        // The thread is gone, which no panic of a solver can do.
        let died = || Failure::new(FailureKind::Internal, "the solver thread had died");
        for place in self.to_solve() {
            self.members[place].phase = Phase::Solved(Outcome::Broken(died()));
        }
    }

    /// Waits for the next outcome; `false` when there will be no more.
    pub(super) async fn next_outcome(&mut self) -> bool {
        let Some(solver) = &mut self.solver else {
            return false;
        };
        match solver.outcomes.recv().await {
            Some((place, outcome)) => {
                self.members[place].phase = Phase::Solved(outcome);
                self.keeper.alive();
                true
            }
            None => false,
        }
    }

    /// Nothing more is begun: what the thread has not taken up goes back to the queue. To be called while the thread waits
    /// at the gate, has ended, or is left behind.
    pub(super) fn close(&mut self) {
        if let Some(solver) = &mut self.solver {
            solver.closed.store(true, Ordering::Release);
            while let Ok((place, outcome)) = solver.outcomes.try_recv() {
                self.members[place].phase = Phase::Solved(outcome);
            }
        }
        for member in &mut self.members {
            if matches!(member.phase, Phase::Solving) && !member.watch.is_taken_up() {
                member.phase = Phase::NotBegun;
            }
        }
    }

    /// The solver does not stop: what it is at counts as abandoned, and its thread is left behind.
    pub(super) fn abandon(&mut self, shared: &Arc<Shared>) {
        self.close();
        for member in &mut self.members {
            if matches!(member.phase, Phase::Solving) {
                member.phase = Phase::Solved(Outcome::Abandoned);
            }
        }
        if let Some(solver) = self.solver.take() {
            shared.leave_behind(solver.thread);
        }
    }

    /// The thread, once it has nothing more to do.
    pub(super) fn take_thread(&mut self) -> Option<SolverThread> {
        self.solver.take().map(|solver| solver.thread)
    }

    /// Are there members that the solver has not come to?
    pub(super) fn has_more_to_begin(&self) -> bool {
        let waits =
            |member: &Member| matches!(member.phase, Phase::Solving) && !member.watch.is_taken_up();
        self.members.iter().any(waits)
    }

    /// Tells the member that the solver is at to stop, and lets it begin no other.
    pub(super) fn stop_begun(&self, reason: Reason) {
        if let Some(solver) = &self.solver {
            solver.closed.store(true, Ordering::Release);
        }
        for member in &self.members {
            if matches!(member.phase, Phase::Solving) && member.watch.is_taken_up() {
                member.watch.stop(reason);
            }
        }
    }

    /// Tells every member to stop.
    pub(super) fn stop(&self, reason: Reason) {
        for member in &self.members {
            member.watch.stop(reason);
        }
    }

    /// Was it told to stop, or has its solver ended, while it waited?
    pub(super) fn is_stopped(&self) -> bool {
        let stopped = |member: &Member| {
            matches!(member.phase, Phase::Solving) && member.watch.reason().is_some()
        };
        self.members.iter().any(stopped)
    }

    /// Bytes that its solver is estimated to hold.
    pub(super) fn memory_bytes(&self) -> u64 {
        let bytes = self
            .members
            .iter()
            .map(|member| member.watch.memory_bytes());
        bytes.max().unwrap_or(0)
    }

    /// Claims of the members that are in the phase that `is` tells.
    pub(super) fn claims(&self, is: impl Fn(&Phase) -> bool) -> Vec<Claim> {
        let members = self.members.iter().filter(|member| is(&member.phase));
        members.map(|member| member.claim.clone()).collect()
    }

    /// Members with these ids need nothing more.
    pub(super) fn done(&mut self, ids: &[Uuid]) {
        self.keeper.let_go(ids);
        for member in &mut self.members {
            if ids.contains(&member.claim.id) {
                member.phase = Phase::Done;
            }
        }
    }

    /// Members equal to an earlier one wait for its answer.
    pub(super) fn set_aside_twins(&mut self) {
        let mut firsts = HashMap::new();
        for member in &mut self.members {
            let Some(key) = member.claim.reuse_key else {
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

/// An entry in the list of running attempts, as long as it lives.
#[derive(Debug)]
pub(super) struct Registered {
    shared: Arc<Shared>,
    id: Uuid,
    watch: Arc<Watch>,
}

impl Registered {
    fn new(shared: &Arc<Shared>, id: Uuid, watch: &Arc<Watch>) -> Registered {
        shared.running().insert(id, watch.clone());
        Registered {
            shared: shared.clone(),
            id,
            watch: watch.clone(),
        }
    }
}

impl Drop for Registered {
    fn drop(&mut self) {
        let mut running = self.shared.running();
        // Another worker may have taken the job over meanwhile; its entry stays.
        if running
            .get(&self.id)
            .is_some_and(|watch| Arc::ptr_eq(watch, &self.watch))
        {
            running.remove(&self.id);
        }
    }
}
