//! How a running job is followed and stopped: flags shared by the solver's thread and the async side.

use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::contact::monitor::{Monitor, Stop};

/// Why a running solve was told to stop. The first reason given stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Reason {
    /// The client cancelled the job.
    Cancel = 1,
    /// The service shuts down; the job goes back to the queue.
    Shutdown = 2,
    /// The lease is lost; whatever comes out is discarded.
    Lost = 3,
    /// The deadline of the job has passed.
    Deadline = 4,
}

/// One attempt at a job, seen from both sides. The solver ticks, the async side reads and stops.
#[derive(Debug, Default)]
pub struct Watch {
    reason: AtomicU8,
    ticks: AtomicU64,
    progress: AtomicU64,
    begun: OnceLock<Instant>,
}

impl Watch {
    /// Starts the clock of the solve, against which `contact` holds the time limit of the case. Only the first call
    /// counts.
    pub fn begin(&self) {
        self.begun.get_or_init(Instant::now);
    }

    /// Tells the solver to stop at its next tick.
    pub fn stop(&self, reason: Reason) {
        // A second reason changes nothing: the solver is stopping already.
        let _ = self
            .reason
            .compare_exchange(0, reason as u8, Ordering::AcqRel, Ordering::Acquire);
    }

    /// Why the solver was told to stop, if it was.
    #[must_use]
    pub fn reason(&self) -> Option<Reason> {
        match self.reason.load(Ordering::Acquire) {
            1 => Some(Reason::Cancel),
            2 => Some(Reason::Shutdown),
            3 => Some(Reason::Lost),
            4 => Some(Reason::Deadline),
            _ => None,
        }
    }

    /// How often the solver has ticked; a figure that stands still means a solver that does.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Acquire)
    }

    /// Progress as last reported, 0 to 1.
    #[must_use]
    pub fn progress(&self) -> f64 {
        f64::from_bits(self.progress.load(Ordering::Acquire))
    }
}

impl Monitor for Watch {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.ticks.fetch_add(1, Ordering::AcqRel);
        if progress.is_finite() {
            self.progress
                .store(progress.clamp(0.0, 1.0).to_bits(), Ordering::Release);
        }
        if self.reason().is_some() {
            return ControlFlow::Break(Stop::Cancelled);
        }
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.begun.get().map_or(Duration::ZERO, Instant::elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_to_stop_stays() {
        let watch = Watch::default();
        assert_eq!(watch.tick(0.5), ControlFlow::Continue(()));
        watch.stop(Reason::Cancel);
        watch.stop(Reason::Shutdown);
        assert_eq!(watch.reason(), Some(Reason::Cancel));
        assert_eq!(watch.tick(0.6), ControlFlow::Break(Stop::Cancelled));
        assert_eq!(watch.ticks(), 2);
    }

    #[test]
    fn the_clock_starts_once_and_with_the_solve() {
        let watch = Watch::default();
        assert_eq!(watch.elapsed(), Duration::ZERO);
        watch.begin();
        let first = watch.elapsed();
        watch.begin();
        assert!(watch.elapsed() >= first);
    }

    #[test]
    fn progress_stays_a_fraction() {
        let watch = Watch::default();
        let _ = watch.tick(7.0);
        assert!((watch.progress() - 1.0).abs() < f64::EPSILON);
        let _ = watch.tick(f64::NAN);
        assert!((watch.progress() - 1.0).abs() < f64::EPSILON);
    }
}
