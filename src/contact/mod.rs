//! What is the physics? Plain synchronous arithmetic: no async, files, environment or printing.
//!
//! A case is [`check`]ed and becomes a [`CheckedCase`]; [`solve`] takes its motions slice by slice through the
//! [`stages`]: footprint, motions from coarse to fine levels, answer. Frame, signs, units and words: [`conventions`].

pub mod answer;
pub mod case;
pub mod conventions;
pub mod coupling;
pub mod error;
pub mod evaluate;
pub mod forecast;
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
pub mod stages;
pub mod time_limit;
pub mod unlike;
pub mod wheelset;

use std::sync::Arc;

use serde_json::Value;

use crate::contact::case::limits::Limits;
use crate::contact::case::problem::CheckedCase;
use crate::contact::case::read::draft;
use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::Monitor;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::slices::{slices, solve_slice};
use crate::contact::solution::words::{Fields, Solution};

/// Reads and checks a case.
///
/// # Errors
/// Every fault of the case at once: those of the text, and those of its sound parts against physics and limits.
pub fn check(case: &Value, limits: &Limits) -> Result<CheckedCase, CaseError> {
    let (draft, mut faults) = draft::draft(case);
    if !faults.is_empty() {
        faults.extend(draft.faults_beside(limits));
        return Err(CaseError(faults));
    }
    CheckedCase::new(&draft.complete().ok_or(CaseError(faults))?, limits)
}

/// Solves a checked case: region and pressure where they are not known yet, then every motion from a coarse mesh level
/// up to the first that meets the target; of a wheel on a rail patch by patch.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(case: &CheckedCase, monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    solve_with(&Arc::default(), case, monitor)
}

/// The same for one of many problems: operators of patches of the same shape are kept in the store for the next.
///
/// # Errors
/// The same.
pub fn solve_with(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let mut answer: Option<(Solution, Fields)> = None;
    for range in slices(case) {
        let (more, more_fields) = solve_slice(operators, case, range, monitor)?;
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
