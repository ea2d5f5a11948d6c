//! What the workers do with a case: check it, solve it. Production uses `contact`; tests may put in their own.

use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

use serde_json::Value;

use crate::contact;
use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::Monitor;
use crate::contact::problem::{Limits, Problem};
use crate::contact::solution::{Fields, Solution};
use crate::contact::tangential::prepared::Cache;

/// Bytes of influence matrices that each solver thread keeps for the next patches of the same shape.
const PREPARED_BYTES: usize = 64 << 20;

thread_local! {
    static PREPARED: Rc<Cache> = Rc::new(Cache::new(PREPARED_BYTES));
}

/// Checks a case against limits.
pub type Check = dyn Fn(&Value, &Limits) -> Result<Problem, CaseError> + Send + Sync;
/// Solves a checked case under a monitor.
pub type Solve =
    dyn Fn(&Problem, &dyn Monitor) -> Result<(Solution, Fields), SolveError> + Send + Sync;

/// How a case becomes an answer.
#[derive(Clone)]
pub struct Recipe {
    /// The first step, done at submission and again before solving.
    pub check: Arc<Check>,
    /// The second step, done on a solver thread.
    pub solve: Arc<Solve>,
}

impl Recipe {
    /// The real physics.
    #[must_use]
    pub fn contact() -> Recipe {
        Recipe {
            check: Arc::new(contact::check),
            solve: Arc::new(|problem, monitor| {
                PREPARED.with(|cache| contact::solve_with(cache, problem, monitor))
            }),
        }
    }
}

impl fmt::Debug for Recipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Recipe")
    }
}
