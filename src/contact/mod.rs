//! What is the physics? Plain synchronous arithmetic: no async, files, environment or printing.
//!
//! Units everywhere: mm, N, MPa, rad; creepages are dimensionless, spin is in 1/mm.

pub mod case;
pub mod coupling;
pub mod error;
pub mod friction;
pub mod geometry;
pub mod half_space;
pub mod mesh;
pub mod monitor;
pub mod normal;
pub mod numerics;
pub mod post;
pub mod profile_trust;
pub mod remark;
pub mod rolling;
pub mod slices;
pub mod solution;

use std::sync::Arc;

use serde_json::Value;

use crate::contact::case::limits::Limits;
use crate::contact::case::problem::Problem;
use crate::contact::case::read::draft;
use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::Monitor;
use crate::contact::normal::region::Region;
use crate::contact::profile_trust::trust;
use crate::contact::rolling::force_control;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling::refinement::level_solve::MotionAnswer;
use crate::contact::rolling::refinement::levels::Levels;
use crate::contact::slices::{slices, solve_slice};
use crate::contact::solution::assemble::Assembly;
use crate::contact::solution::finish::{finish, share_seconds};
use crate::contact::solution::words::{Fields, Solution};
use crate::contact::time_limit::TimeLimit;

/// Reads and checks a case.
///
/// # Errors
/// Every fault of the case at once: those of the text, and those of its sound parts against physics and limits.
pub fn check(case: &Value, limits: &Limits) -> Result<Problem, CaseError> {
    let (draft, mut faults) = draft::draft(case);
    if !faults.is_empty() {
        faults.extend(draft.faults_beside(limits));
        return Err(CaseError(faults));
    }
    Problem::new(&draft.complete().ok_or(CaseError(faults))?, limits)
}

/// Solves a checked case: region and pressure where they are not known yet, then every motion from a coarse mesh level
/// up to the first that meets the target; of a wheel on a rail patch by patch.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(problem: &Problem, monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    solve_with(&Arc::default(), problem, monitor)
}

/// The same for one of many problems: operators of patches of the same shape are kept in the store for the next.
///
/// # Errors
/// The same.
pub fn solve_with(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let mut answer: Option<(Solution, Fields)> = None;
    for range in slices(problem) {
        let (more, more_fields) = solve_slice(operators, problem, range, monitor)?;
        match &mut answer {
            None => answer = Some((more, more_fields)),
            Some((solution, fields)) => {
                solution.append(more);
                fields.append(more_fields);
            }
        }
    }
    let Some(answer) = answer else {
        unreachable!("a case has at least one slice")
    };
    Ok(answer)
}

/// Solves all motions of a problem one after the other, as long as one slice.
fn solve_whole(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let began = monitor.elapsed();
    let answer = if let Region::Profiles(contact) = &problem.region {
        trust::solve(operators, problem, contact, monitor)?
    } else {
        let watch = TimeLimit::new(monitor, problem.time_limit, problem.motions.len());
        let pressed = problem.pressed(&watch);
        let pressed = pressed.map_err(|error| watch.explained(error, problem))?;
        answer(operators, pressed.as_ref(), &watch)?
    };
    finish(problem, answer, monitor.elapsed().saturating_sub(began))
}

/// Solves every motion of a problem whose region and pressure are known.
fn answer(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let answer = motions(operators, problem, watch);
    let (mut solution, fields) = answer.map_err(|error| watch.explained(error, problem))?;
    share_seconds(&mut solution);
    Ok((solution, fields))
}

fn motions(
    operators: &Arc<OperatorStore>,
    problem: &Problem,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let footprint = problem.footprint();
    let task = problem.rolling_task(&footprint);
    let mut levels = Levels::new(&task, operators);
    let mut assembly = Assembly::new(problem);
    let mut before: Option<MotionAnswer> = None;
    for index in 0..problem.motions.len() {
        let mut point = force_control::solve(&task, &mut levels, index, before.as_ref(), watch)?;
        if index == 0 {
            // What all motions share is charged to the first.
            point.seconds += problem.normal.map_or(0.0, |normal| normal.seconds);
        }
        assembly.add(&levels, &point);
        levels.trim();
        before = Some(point);
        watch.advance();
    }
    Ok(assembly.finish())
}
pub mod time_limit;
