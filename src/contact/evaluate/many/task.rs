//! What many rows are, and what one of them asks.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::Value;

use crate::contact;
use crate::contact::case::known_pair::KnownPair;
use crate::contact::case::limits::Limits;
use crate::contact::case::words::solver::Output;
use crate::contact::error::{CaseError, Fault, SolveError};
use crate::contact::evaluate::varied::{VariedColumn, case_of_row};
use crate::contact::monitor::Monitor;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::solution::words::answer::Solution;

/// Solves a checked case.
pub type RowSolver<'a> = dyn Fn(&CheckedCase, &dyn Monitor) -> Result<Solution, SolveError> + 'a;

/// Rows to solve.
#[derive(Debug, Clone, Copy)]
pub struct ManyTask<'a> {
    /// A good case of one motion, such as that of the first of all rows.
    pub case: &'a Value,
    /// What differs from it, at least one column; all of the same length.
    pub columns: &'a [VariedColumn],
    /// Cross-sections that rows name, by their names.
    pub profiles: &'a BTreeMap<String, Value>,
    /// Pairs of cross-sections that were read before.
    pub known: &'a KnownPair,
    /// What a row may use.
    pub limits: &'a Limits,
    /// Longest time for one row; a shorter one of the case counts.
    pub time_limit: Duration,
}

impl ManyTask<'_> {
    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.columns.first().map_or(1, |column| column.values.len())
    }

    /// The checked case of a row.
    ///
    /// # Errors
    /// Its faults.
    pub(crate) fn checked(&self, row: usize) -> Result<CheckedCase, CaseError> {
        let case = case_of_row(self.case, self.columns, self.profiles, row)
            .map_err(|(pointer, reason)| CaseError(vec![Fault::new(pointer, reason)]))?;
        let checked = contact::check_with(self.known, &case, self.limits)?;
        match several_answers(&checked) {
            Some(fault) => Err(CaseError(vec![fault])),
            None => Ok(self.as_row(checked)),
        }
    }

    /// A checked case with the outputs and the time limit of a row.
    pub(crate) fn as_row(&self, mut checked: CheckedCase) -> CheckedCase {
        // Rows are answered with numbers alone.
        let numbers = [Output::Resultants, Output::Zones, Output::Gradients];
        let outputs = &mut checked.run.outputs;
        outputs.retain(|output| numbers.contains(output));
        let own = checked.run.time_limit;
        checked.run.time_limit = Some(own.map_or(self.time_limit, |own| own.min(self.time_limit)));
        checked
    }
}

/// The fault of a case that has several answers, so that no row stands for it.
#[must_use]
pub fn several_answers(checked: &CheckedCase) -> Option<Fault> {
    let problem = &checked.problem;
    let (motions, positions) = (problem.motions.len(), problem.task.positions());
    if motions > 1 {
        let detail = format!("{motions} motions given; a row has one motion, and columns vary it");
        return Some(Fault::new("/motion", detail));
    }
    (positions > 1).then(|| {
        let detail = format!(
            "{positions} positions of the wheelset with their motions given; a row has one position with one motion, and columns vary them"
        );
        Fault::new("/contact", detail)
    })
}
