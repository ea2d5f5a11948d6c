//! The interface by which a caller follows and stops a solve. It is the only clock of this crate.

use std::ops::ControlFlow;
use std::time::Duration;

/// Why the caller stopped a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The caller does not need the answer.
    Cancelled,
    /// The time limit of the case was reached.
    OutOfTime,
}

/// Follows a solve. It is called once per strip of an assembly and once per Krylov step, so it must be cheap.
pub trait Monitor {
    /// Receives the rough progress, 0 to 1, and decides whether the solve continues.
    fn tick(&self, progress: f64) -> ControlFlow<Stop>;
    /// Returns the time since the solve began.
    fn elapsed(&self) -> Duration;

    /// Calls [`tick`](Monitor::tick) and returns a stop as an error.
    ///
    /// # Errors
    /// The reason why the solve must end.
    fn go_on(&self, progress: f64) -> Result<(), Stop> {
        match self.tick(progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(stop) => Err(stop),
        }
    }
}

/// The monitor of a part of the work.
pub(crate) struct MonitorPart<'a> {
    inner: &'a dyn Monitor,
    before: f64,
    own: f64,
}

impl<'a> MonitorPart<'a> {
    /// Creates the monitor of a part from that of the whole work, the progress when the part begins, and the progress that it adds.
    pub(crate) fn new(inner: &'a dyn Monitor, before: f64, own: f64) -> MonitorPart<'a> {
        MonitorPart { inner, before, own }
    }
}

impl Monitor for MonitorPart<'_> {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.inner.tick(self.before + self.own * progress)
    }

    fn elapsed(&self) -> Duration {
        self.inner.elapsed()
    }
}

/// A monitor that never stops a solve and does not measure time.
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
