//! The control block of one attempt: flags that the solver's thread and the async side share.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock};
use std::time::{Duration, Instant};

use crate::contact::monitor::{Monitor, Stop};
use crate::jobs::sync::lock;

/// Why a running solve was told to stop. The first reason given stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The client cancelled the job.
    Cancel,
    /// The service shuts down; the job goes back to the queue.
    Shutdown,
    /// The lease is lost; whatever comes out is discarded.
    Lost,
    /// The deadline of the job has passed.
    Deadline,
    /// It takes longer than was expected of a short job; it goes back to the queue.
    TooLong,
}

/// One attempt at a job. The solver ticks; the async side reads the progress and stops it.
#[derive(Debug, Default)]
pub struct AttemptControl {
    reason: OnceLock<StopReason>,
    ticks: AtomicU64,
    progress: AtomicU64,
    clock: Mutex<SolveClock>,
    taken_up: AtomicBool,
}

/// How long a solve has taken.
#[derive(Debug, Default)]
struct SolveClock {
    /// Before it last went on.
    spent: Duration,
    /// Since when it goes on.
    since: Option<Instant>,
}

impl AttemptControl {
    /// The solver's thread has come to this job.
    pub fn take_up(&self) {
        self.taken_up.store(true, Ordering::Release);
    }

    /// The solver's thread has not come to this job, or has yet to come again.
    pub fn reset_started(&self) {
        self.taken_up.store(false, Ordering::Release);
    }

    /// Has the solver's thread come to this job?
    #[must_use]
    pub fn is_started(&self) -> bool {
        self.taken_up.load(Ordering::Acquire)
    }

    /// Starts the clock of the solve, against which `contact` holds the time limit of the case, at the time that was spent
    /// before. It goes on until [`AttemptControl::pause`]; a clock that goes is left alone.
    pub fn begin(&self, spent: Duration) {
        let mut clock = self.clock();
        if clock.since.is_none() {
            *clock = SolveClock {
                spent,
                since: Some(Instant::now()),
            };
        }
    }

    /// Stops the clock and returns the time spent in all.
    pub fn pause(&self) -> Duration {
        let spent = self.elapsed();
        *self.clock() = SolveClock { spent, since: None };
        spent
    }

    fn clock(&self) -> MutexGuard<'_, SolveClock> {
        lock(&self.clock)
    }

    /// Tells the solver to stop at its next tick.
    pub fn stop(&self, reason: StopReason) {
        // A second reason changes nothing: the solver is stopping already.
        let _ = self.reason.set(reason);
    }

    /// Why the solver was told to stop, if it was.
    #[must_use]
    pub fn reason(&self) -> Option<StopReason> {
        self.reason.get().copied()
    }

    /// How often the solver has ticked. If this stands still, so does the solver.
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

impl Monitor for AttemptControl {
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
        let clock = self.clock();
        clock.spent + clock.since.map_or(Duration::ZERO, |since| since.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_to_stop_stays() {
        let control = AttemptControl::default();
        assert_eq!(control.tick(0.5), ControlFlow::Continue(()));
        control.stop(StopReason::Cancel);
        control.stop(StopReason::Shutdown);
        assert_eq!(control.reason(), Some(StopReason::Cancel));
        assert_eq!(control.tick(0.6), ControlFlow::Break(Stop::Cancelled));
        assert_eq!(control.ticks(), 2);
    }

    #[test]
    fn the_clock_counts_the_solve_and_what_was_spent_before() {
        let control = AttemptControl::default();
        assert_eq!(control.elapsed(), Duration::ZERO);
        let before = Duration::from_secs(100);
        control.begin(before);
        let first = control.elapsed();
        control.begin(Duration::ZERO);
        assert!(first >= before && control.elapsed() >= first);
        let spent = control.pause();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(control.elapsed(), spent, "nothing is solved meanwhile");
        control.begin(spent);
        assert!(control.elapsed() >= spent);
    }

    #[test]
    fn progress_stays_a_fraction() {
        let control = AttemptControl::default();
        let _ = control.tick(7.0);
        assert!((control.progress() - 1.0).abs() < f64::EPSILON);
        let _ = control.tick(f64::NAN);
        assert!((control.progress() - 1.0).abs() < f64::EPSILON);
    }
}
