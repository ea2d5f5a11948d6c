//! What the workers do with a case: check it, solve it. Production uses `contact`; tests may put in their own.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use serde_json::Value;

use railhead_contact::case::solver::{KnownPair, Limits};
use railhead_contact::check_with;
use railhead_contact::error::{CaseError, SolveError};
use railhead_contact::monitor::Monitor;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::slices::slices;
use railhead_contact::solution::words::answer::{Fields, Solution};
use railhead_contact::solve_slice;

/// Checks a case against limits, with pairs of cross-sections that were read before.
pub type Check =
    dyn Fn(&KnownPair, &Value, &Limits) -> Result<CheckedCase, CaseError> + Send + Sync;

/// Where a checked case is cut: ranges of motions, one after the other.
pub type Slices = dyn Fn(&CheckedCase) -> Vec<Range<usize>> + Send + Sync;

/// Solves one of these ranges of a checked case under a monitor.
pub type Solve = dyn Fn(&CheckedCase, Range<usize>, &dyn Monitor) -> Result<(Solution, Fields), SolveError>
    + Send
    + Sync;

/// How a case becomes an answer.
#[derive(Clone)]
pub struct Engine {
    /// The first step, done at submission and again before solving.
    pub check: Arc<Check>,
    /// Where the second step is cut, by the case alone.
    pub slices: Arc<Slices>,
    /// The second step, done on a solver thread, slice by slice.
    pub solve: Arc<Solve>,
    /// What all solver threads share.
    pub operators: Arc<OperatorStore>,
    /// Pairs of cross-sections that were read before, for all checks.
    pub known: Arc<KnownPair>,
}

impl Engine {
    /// The real physics, with operators kept in a store of the usual size.
    #[must_use]
    pub fn contact() -> Engine {
        Engine::with_operators(OperatorStore::default())
    }

    /// The real physics with this store.
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
    /// Those of the solver.
    pub fn solve_whole(
        &self,
        checked: &CheckedCase,
        monitor: &dyn Monitor,
    ) -> Result<Solution, SolveError> {
        let mut whole: Option<Solution> = None;
        for slice in (self.slices)(checked) {
            let (solution, _) = (self.solve)(checked, slice, monitor)?;
            match &mut whole {
                None => whole = Some(solution),
                Some(all) => all.append(solution),
            }
        }
        whole.ok_or(SolveError::Cancelled)
    }

    /// The same with another solver, which solves every case at once.
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
