//! The functions that check and solve a case: those of `contact`, or those of a test.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use serde_json::Value;

use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::check_with;
use railhead_contact::error::{CaseError, SolveError};
use railhead_contact::monitor::Monitor;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::slices::{joined, slices};
use railhead_contact::solution::words::answer::{Fields, Solution};
use railhead_contact::solve_slice;

/// Checks a case against limits, with a cache of parsed profile pairs.
pub type Check =
    dyn Fn(&KnownPair, &Value, &Limits) -> Result<CheckedCase, CaseError> + Send + Sync;

/// Divides a checked case into slices: consecutive ranges of motions.
pub type Slices = dyn Fn(&CheckedCase) -> Vec<Range<usize>> + Send + Sync;

/// Solves a slice of a checked case.
pub type Solve = dyn Fn(&CheckedCase, Range<usize>, &dyn Monitor) -> Result<(Solution, Fields), SolveError>
    + Send
    + Sync;

/// The functions that check and solve a case.
#[derive(Clone)]
pub struct Engine {
    /// Called at submission and again before solving.
    pub check: Arc<Check>,
    /// Depends on the case alone.
    pub slices: Arc<Slices>,
    /// Called on a solver thread for each slice.
    pub solve: Arc<Solve>,
    /// Mesh operators that all solver threads share.
    pub operators: Arc<OperatorStore>,
    /// Cache of parsed profile pairs for all checks.
    pub known: Arc<KnownPair>,
}

impl Engine {
    /// The engine of `contact`, with an operator store of the default size.
    #[must_use]
    pub fn contact() -> Engine {
        Engine::with_operators(OperatorStore::default())
    }

    /// The engine of `contact` with this operator store.
    #[must_use]
    pub fn with_operators(operators: OperatorStore) -> Engine {
        let operators = Arc::new(operators);
        let store = Arc::clone(&operators);
        Engine {
            check: Arc::new(check_with),
            slices: Arc::new(slices),
            solve: Arc::new(move |checked, slice, monitor| {
                solve_slice(&store, checked, slice, monitor)
            }),
            operators,
            known: Arc::default(),
        }
    }

    /// Solves a checked case, slice by slice.
    ///
    /// # Errors
    /// Errors of the solver.
    pub fn solve_whole(
        &self,
        checked: &CheckedCase,
        monitor: &dyn Monitor,
    ) -> Result<Solution, SolveError> {
        let slices = (self.slices)(checked).into_iter();
        let answers = slices.map(|slice| (self.solve)(checked, slice, monitor));
        joined(answers).map(|(solution, _)| solution)
    }

    /// The same engine with another solver, which solves each case as a single slice.
    #[must_use]
    pub fn solving<F>(self, solve: F) -> Engine
    where
        F: Fn(&CheckedCase, &dyn Monitor) -> Result<(Solution, Fields), SolveError>
            + Send
            + Sync
            + 'static,
    {
        Engine {
            slices: Arc::new(|checked| std::iter::once(0..checked.problem.motions.len()).collect()),
            solve: Arc::new(move |checked, _, monitor| solve(checked, monitor)),
            ..self
        }
    }
}

impl fmt::Debug for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Engine")
    }
}
