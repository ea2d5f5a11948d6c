//! The stages of a solve: region and pressure, motions, answer; of a wheel on a rail they are gone through together.

use std::sync::Arc;

use crate::contact::answer::answer;
use crate::contact::case::problem::Problem;
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::profile_trust::trust;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::finish::finish;
use crate::contact::solution::words::{Fields, Solution};
use crate::contact::time_limit::TimeLimit;

/// Solves all motions of a problem one after the other, as long as one slice.
///
/// # Errors
/// A named reason why there is no answer; or the monitor stopped the work.
pub(crate) fn solve_whole(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let began = monitor.elapsed();
    let answer = if let NormalTask::Wheel(contact) = &problem.task {
        trust::solve(operators, problem, contact, monitor)?
    } else {
        let watch = TimeLimit::new(monitor, problem.time_limit, problem.motions.len());
        let pressed = problem.pressed(&watch);
        let pressed = pressed.map_err(|error| watch.explained(error, problem))?;
        answer(operators, problem, &pressed, &watch)?
    };
    finish(problem, answer, monitor.elapsed().saturating_sub(began))
}
