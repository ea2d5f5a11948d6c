//! The stages of a solve: region and pressure, motions, answer; of a wheel on a rail they are gone through together.

use std::sync::Arc;

use crate::contact::answer::answer;
use crate::contact::case::problem::CheckedCase;
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::profile_trust::trust;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::finish::finish;
use crate::contact::solution::words::{Fields, Solution};
use crate::contact::time_limit::TimeLimit;
use crate::contact::unlike;
use crate::contact::wheelset::solve;

/// Solves all motions of a problem one after the other, as long as one slice.
///
/// # Errors
/// A named reason why there is no answer; or the monitor stopped the work.
pub(crate) fn solve_whole(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let began = monitor.elapsed();
    let answer = if let NormalTask::Wheel(contact) = &case.problem.task {
        trust::solve(operators, case, contact, monitor)?
    } else if let NormalTask::Wheelset(wheelset) = &case.problem.task {
        solve::solve(operators, case, wheelset, monitor)?
    } else {
        let watch = TimeLimit::new(monitor, case.run.time_limit, case.problem.motions.len());
        if case.problem.is_coupled(&case.run) {
            let answer = unlike::solve(operators, case, &watch);
            answer.map_err(|error| watch.explained(error, case))?
        } else {
            let pressed = case.pressed(&watch);
            let pressed = pressed.map_err(|error| watch.explained(error, case))?;
            answer(operators, case, &pressed, &watch)?
        }
    };
    finish(case, answer, monitor.elapsed().saturating_sub(began))
}
