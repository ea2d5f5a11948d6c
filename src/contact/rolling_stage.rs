//! The stage of the tangential problem: the motions of a problem on its footprint, one after the other, each to its place in the answer.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::normal_stage::SolvedFootprint;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::force_control;
use crate::contact::rolling::history;
use crate::contact::rolling::motion_answer::MotionAnswer;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling::refinement::lender::may_borrow;
use crate::contact::rolling::refinement::level_solve::MotionTask;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::refinement::stretch::Stretch;
use crate::contact::solution::assemble::Assembly;
use crate::contact::solution::finish::share_seconds;
use crate::contact::solution::words::answer::Solution;
use crate::contact::solution::words::fields::Fields;
use crate::contact::time_limit::TimeLimit;

/// Solves every motion of a problem on a footprint.
///
/// # Errors
/// Why a motion has no answer; or the monitor stopped the work.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let answer = solve_motions(operators, case, solved, watch);
    let (mut solution, fields) = answer.map_err(|error| watch.explained(error, case))?;
    share_seconds(&mut solution);
    Ok((solution, fields))
}

fn solve_motions(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let mut task = case.rolling_task(&solved.footprint);
    task.resolution = task.resolution.beside(solved.coupling_error);
    if let Some(reason) = task.falls_too_fast() {
        return Err(SolveError::NotCovered { reason });
    }
    let mut state = RefinementState::new(&task, operators);
    let mut assembly = Assembly::new(case, solved);
    if let Some(history) = &case.problem.history {
        let patches = solved.footprint.patches().iter();
        let extents: Vec<[f64; 4]> = patches.map(|patch| patch.extent).collect();
        if let Some(reason) = history::solve::too_long(history, &extents, case.run.steps_max) {
            return Err(SolveError::NotCovered { reason });
        }
        let part = watch.of_next(case.problem.motions.len());
        for mut point in history::solve::solve(&task, history, &mut state, &part)? {
            add_coupling_error(&mut point, solved.coupling_error);
            if assembly.is_empty() {
                point.seconds += solved.report.map_or(0.0, |report| report.seconds);
            }
            assembly.add(&state.levels, &point, watch)?;
            watch.advance();
        }
        return Ok(assembly.finish());
    }
    let mut before: Option<MotionAnswer> = None;
    let mut stretch = Stretch::default();
    let motions = case.problem.motions.len();
    for index in 0..motions {
        let mut found = match task.target() {
            Some(target) if may_borrow(&task, index) => {
                let motion = task.motions[index];
                let asked = MotionTask { index, motion };
                let mut found = stretch.solve(&task, &mut state, asked, target, watch)?;
                if index + 1 == motions {
                    found.extend(stretch.end(&task, &mut state, target, watch)?);
                }
                found
            }
            target => {
                let target = target.unwrap_or_default();
                let mut found = stretch.end(&task, &mut state, target, watch)?;
                let last = found.last().or(before.as_ref());
                found.push(force_control::solve(&task, &mut state, index, last, watch)?);
                found
            }
        };
        for point in &mut found {
            add_coupling_error(point, solved.coupling_error);
            if assembly.is_empty() {
                // What all motions share is charged to the first.
                point.seconds += solved.report.map_or(0.0, |report| report.seconds);
            }
            assembly.add(&state.levels, point, watch)?;
            watch.advance();
        }
        if stretch.is_settled() {
            state.trim();
        }
        before = found.pop().or(before);
    }
    Ok(assembly.finish())
}

/// Adds the error of the pressures (see [`SolvedFootprint`]) to the estimates.
fn add_coupling_error(point: &mut MotionAnswer, coupling: f64) {
    if coupling > 0.0 {
        let errors = point.errors.iter_mut().flatten();
        errors.for_each(|error| *error = error.hypot(coupling));
    }
}
