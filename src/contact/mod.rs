//! What is the physics? Plain synchronous arithmetic: no async, files, environment or printing.
//!
//! Units everywhere: mm, N, MPa, rad; creepages are dimensionless, spin is in 1/mm.

pub mod case;
pub mod error;
pub mod mesh;
pub mod monitor;
pub mod normal;
pub mod outputs;
pub mod problem;
mod read;
pub mod solution;
pub mod zones;

use serde_json::Value;

use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::Monitor;
use crate::contact::problem::{Limits, Problem};
use crate::contact::solution::{Fields, Solution};

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

/// Solves a checked case.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(_problem: &Problem, _monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    todo!("the recipe")
}
