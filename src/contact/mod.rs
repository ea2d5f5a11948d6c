//! What is the physics? Plain synchronous arithmetic: no async, files, environment or printing.
//!
//! Units everywhere: mm, N, MPa, rad; creepages are dimensionless, spin is in 1/mm.

pub mod case;
pub mod error;
pub mod influence;
pub mod mesh;
pub mod monitor;
pub mod normal;
pub mod outputs;
pub mod problem;
mod read;
pub mod solution;
pub mod tangential;
pub mod zones;

use serde_json::Value;

use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::{Monitor, Watch};
use crate::contact::outputs::assemble::assemble;
use crate::contact::problem::{Limits, Problem};
use crate::contact::solution::{Fields, Solution};
use crate::contact::tangential::level::Level;
use crate::contact::tangential::point;

/// Reads and checks a case.
///
/// # Errors
/// Every fault of the case at once: those of the text, and those of its sound parts against physics and limits.
pub fn check(case: &Value, limits: &Limits) -> Result<Problem, CaseError> {
    let (draft, mut faults) = read::draft(case);
    if !faults.is_empty() {
        faults.extend(draft.faults_beside(limits));
        return Err(CaseError(faults));
    }
    Problem::new(&draft.complete().ok_or(CaseError(faults))?, limits)
}

/// Solves a checked case: region and pressure where they are not known yet, mesh levels and their pressures, then every motion from the coarsest level to the finest.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(problem: &Problem, monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    let watch = Watch::new(monitor, problem.time_limit, problem.motions.len());
    let problem = problem.pressed(&watch)?;
    let problem = problem.as_ref();
    let levels = problem
        .levels()
        .into_iter()
        .map(|size| Level::new(problem, size));
    let levels: Vec<Level> = levels.collect::<Result<_, _>>()?;
    let mut points = Vec::with_capacity(problem.motions.len());
    for index in 0..problem.motions.len() {
        points.push(point::solve(problem, &levels, index, &watch)?);
        watch.advance();
    }
    Ok(assemble(problem, &levels[levels.len() - 1], &points))
}
