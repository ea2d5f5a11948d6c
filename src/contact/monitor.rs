//! How a caller follows and stops a solve. The only clock `contact` has.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Duration;

use crate::contact::case::problem::Problem;
use crate::contact::error::SolveError;

/// Why a solve was stopped from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The caller no longer wants the answer.
    Cancelled,
    /// The time allowed for the case is used up.
    OutOfTime,
}

/// Watches a solve. Called once per strip of an assembly and once per Krylov step, so it must be cheap.
pub trait Monitor {
    /// Takes note of the progress (0 to 1, rough) and says whether to go on.
    fn tick(&self, progress: f64) -> ControlFlow<Stop>;
    /// Time since the solve began.
    fn elapsed(&self) -> Duration;
}

/// Never stops a solve and measures no time; for tests and for callers that just want the answer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Monitor for Unwatched {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}

/// The monitor of a whole case: adds the case's own time limit and turns motions done into progress.
pub(crate) struct Watch<'a> {
    inner: &'a dyn Monitor,
    time_limit: Option<Duration>,
    motions: usize,
    done: Cell<usize>,
}

impl<'a> Watch<'a> {
    /// Watches a case of so many motions.
    pub(crate) fn new(
        inner: &'a dyn Monitor,
        time_limit: Option<Duration>,
        motions: usize,
    ) -> Watch<'a> {
        Watch {
            inner,
            time_limit,
            motions,
            done: Cell::new(0),
        }
    }

    /// An error of this case; one of time with the limit and how far the solve came.
    pub(crate) fn explained(&self, error: SolveError, problem: &Problem) -> SolveError {
        let SolveError::OutOfTime { limit_s: None, .. } = error else {
            return error;
        };
        // Of a wheel on a rail every motion is solved patch by patch.
        let done = self.done.get() * problem.motions.len() / self.motions.max(1);
        SolveError::OutOfTime {
            limit_s: self.time_limit.map(|limit| limit.as_secs_f64()),
            motions: Some([problem.part.before + done, problem.part.all]),
        }
    }

    /// One more motion is done.
    pub(crate) fn advance(&self) {
        self.done.set(self.done.get() + 1);
    }
}

impl Monitor for Watch<'_> {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        if self
            .time_limit
            .is_some_and(|limit| self.inner.elapsed() > limit)
        {
            return ControlFlow::Break(Stop::OutOfTime);
        }
        self.inner
            .tick(self.done.get() as f64 / self.motions.max(1) as f64)
    }

    fn elapsed(&self) -> Duration {
        self.inner.elapsed()
    }
}
