//! How a caller follows and stops a solve. The only clock `contact` has.

use std::ops::ControlFlow;
use std::time::Duration;

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

    /// Calls [`tick`](Monitor::tick) and returns a stop as an error.
    ///
    /// # Errors
    /// Why the solve is to end.
    fn go_on(&self, progress: f64) -> Result<(), Stop> {
        match self.tick(progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(stop) => Err(stop),
        }
    }
}

/// The monitor of a part of the work.
pub(crate) struct MonitorPart<'a> {
    /// That of all of it.
    pub(crate) inner: &'a dyn Monitor,
    /// Progress when the part begins.
    pub(crate) before: f64,
    /// What the part adds to it.
    pub(crate) own: f64,
}

impl Monitor for MonitorPart<'_> {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.inner.tick(self.before + self.own * progress)
    }

    fn elapsed(&self) -> Duration {
        self.inner.elapsed()
    }
}

/// Never stops a solve and measures no time; for tests and for callers that just want the answer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unmonitored;

impl Monitor for Unmonitored {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}
