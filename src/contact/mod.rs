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
/// Every fault of the case at once.
pub fn check(_case: &Value, _limits: &Limits) -> Result<Problem, CaseError> {
    todo!("read the case, then Problem::new")
}

/// Solves a checked case.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(_problem: &Problem, _monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    todo!("the recipe")
}
