//! The beginning of an attempt: its jobs are listed as running, their leases kept, its work handed to a thread.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;

use crate::jobs::attempts::attempt::{Attempt, Member, Outcomes, Phase, Solver};
use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::attempts::outcome::{Outcome, Work};
use crate::jobs::attempts::solver_thread::{SolverThread, Task};
use crate::jobs::job_trace::JobTrace;
use crate::jobs::model::job::{Failure, FailureKind};
use crate::jobs::model::kind::Queue;
use crate::jobs::shared::Shared;
use crate::jobs::store::claim::Claim;
use crate::jobs::sync::lock;
use crate::jobs::worker::heartbeat;
use crate::jobs::worker::solve::solve_guarded;

/// A group that takes longer hands back what it has not begun.
const GROUP_TIME: Duration = Duration::from_millis(400);

/// Lists claimed jobs as running and keeps their leases from now on.
pub(crate) fn take_up(
    shared: &Arc<Shared>,
    queue: Queue,
    claims: Vec<Claim>,
    suspect: Option<OwnedMutexGuard<()>>,
) -> Attempt {
    let was_begun = claims.iter().any(|claim| claim.slices > 0);
    let members: Vec<Member> = claims
        .into_iter()
        .map(|claim| {
            let control = Arc::new(AttemptControl::default());
            Member {
                _listed: shared.running.enter(claim.id, &control),
                claim,
                control,
                phase: Phase::Solving,
                case: None,
                sliced: None,
            }
        })
        .collect();
    let held = members
        .iter()
        .map(|one| (one.claim.clone(), one.control.clone()));
    Attempt {
        queue,
        lease: heartbeat::keep(shared, held.collect()),
        members,
        _suspect: suspect,
        was_begun,
        turn_began: Instant::now(),
        spent: Duration::ZERO,
        solver: None,
    }
}

/// Hands the work for the members at these places to a thread.
pub(crate) fn begin(
    shared: &Arc<Shared>,
    attempt: &mut Attempt,
    thread: SolverThread,
    work: Vec<(usize, Work)>,
) {
    attempt.spent = Duration::ZERO;
    let outcomes = Outcomes::default();
    let over = CancellationToken::new();
    let closed = Arc::new(Mutex::new(false));
    let work: Vec<_> = work
        .into_iter()
        .map(|(place, work)| {
            let member = &attempt.members[place];
            member.control.reset_started();
            let traced = shared.job_trace(&member.claim);
            (place, member.control.clone(), work, traced)
        })
        .collect();
    let task: Task = {
        let (shared, closed) = (shared.clone(), closed.clone());
        let (lease, over) = (attempt.lease.0.clone(), over.clone().drop_guard());
        let outcomes = outcomes.clone();
        Box::new(move || {
            let _over = over;
            let start = Instant::now();
            for (number, (place, control, work, traced)) in work.into_iter().enumerate() {
                let late = number > 0 && start.elapsed() > GROUP_TIME;
                {
                    let closed = lock(&closed);
                    if late || *closed || shared.stopping.is_cancelled() {
                        break;
                    }
                    control.take_up();
                }
                let from_queue = matches!(work, Work::New(..));
                let solve = || solve_guarded(&shared, &control, work);
                let outcome = JobTrace::solving(traced.as_ref(), from_queue, solve);
                let mut outcomes = lock(&outcomes);
                outcomes.push((place, outcome));
                lease.alive();
            }
        })
    };
    if thread.give(task) {
        attempt.solver = Some(Solver {
            thread,
            outcomes,
            over,
            closed,
        });
        return;
    }
    // The thread is gone, which no panic of a solver can do.
    let died = || Failure::new(FailureKind::Internal, "the solver thread had died");
    for place in attempt.to_solve() {
        attempt.members[place].phase = Phase::Solved(Outcome::Broken(died()));
    }
}
