//! The time limit of a case: a monitor that ends the solve and counts the solved motions.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Duration;

use crate::error::SolveError;
use crate::monitor::{Monitor, MonitorPart, Stop};
use crate::problem::checked_case::CheckedCase;

/// The monitor of a whole case. It adds the time limit of the case and converts solved motions to progress, which never decreases.
pub(crate) struct TimeLimit<'a> {
    inner: &'a dyn Monitor,
    time_limit: Option<Duration>,
    motions: usize,
    done: Cell<usize>,
    reached: Cell<f64>,
}

impl<'a> TimeLimit<'a> {
    /// Creates the monitor of a case with a number of motions.
    pub(crate) fn new(
        inner: &'a dyn Monitor,
        time_limit: Option<Duration>,
        motions: usize,
    ) -> TimeLimit<'a> {
        TimeLimit {
            inner,
            time_limit,
            motions,
            done: Cell::new(0),
            reached: Cell::new(0.0),
        }
    }

    /// Adds the limit and the progress to an error of the time limit. Other errors stay as they are.
    pub(crate) fn explained(&self, error: SolveError, case: &CheckedCase) -> SolveError {
        let SolveError::OutOfTime { limit_s: None, .. } = error else {
            return error;
        };
        // For a wheel on a rail, each motion is solved once per patch.
        let done = self.done.get() * case.problem.motions.len() / self.motions.max(1);
        SolveError::OutOfTime {
            limit_s: self.time_limit.map(|limit| limit.as_secs_f64()),
            motions: Some([case.problem.part.before + done, case.problem.part.all]),
        }
    }

    /// Returns the monitor of the next `motions`, which are solved together.
    pub(crate) fn of_next(&self, motions: usize) -> MonitorPart<'_> {
        let left = self.motions.saturating_sub(self.done.get()).max(1);
        MonitorPart::new(self, 0.0, (motions as f64 / left as f64).min(1.0))
    }

    /// Counts a solved motion.
    pub(crate) fn advance(&self) {
        self.done.set(self.done.get() + 1);
    }
}

impl Monitor for TimeLimit<'_> {
    /// `progress` is that of the remaining motions.
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        if self
            .time_limit
            .is_some_and(|limit| self.inner.elapsed() > limit)
        {
            return ControlFlow::Break(Stop::OutOfTime);
        }
        let all = self.motions.max(1) as f64;
        let done = self.done.get() as f64;
        let now = (done + progress * (all - done)) / all;
        self.reached.set(self.reached.get().max(now));
        self.inner.tick(self.reached.get())
    }

    fn elapsed(&self) -> Duration {
        self.inner.elapsed()
    }
}
