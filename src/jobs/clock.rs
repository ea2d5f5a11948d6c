//! Wall clock and steady clock of the service, of the system or of a test.
use std::fmt;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::sync::lock;

/// A wall clock and a steady clock, which is never set. Clones share the clocks.
#[derive(Clone)]
pub struct Clock {
    wall: Arc<dyn Fn() -> i64 + Send + Sync>,
    steady: Arc<dyn Fn() -> i64 + Send + Sync>,
}

impl Clock {
    /// The clocks of the system.
    #[must_use]
    pub fn system() -> Clock {
        let start = Instant::now();
        Clock {
            wall: Arc::new(|| jiff::Timestamp::now().as_millisecond()),
            steady: Arc::new(move || {
                i64::try_from(start.elapsed().as_millis()).unwrap_or(i64::MAX)
            }),
        }
    }

    /// Both clocks return `now_ms`, in epoch milliseconds.
    #[must_use]
    pub fn new(now_ms: impl Fn() -> i64 + Send + Sync + 'static) -> Clock {
        let wall: Arc<dyn Fn() -> i64 + Send + Sync> = Arc::new(now_ms);
        Clock {
            steady: wall.clone(),
            wall,
        }
    }

    /// The wall clock returns `now_ms`, and the steady clock is that of the system, as if the wall clock were set.
    #[must_use]
    pub fn that_is_set(now_ms: impl Fn() -> i64 + Send + Sync + 'static) -> Clock {
        Clock {
            wall: Arc::new(now_ms),
            ..Clock::system()
        }
    }

    /// The same clocks with the variable offset `offset_ms` of the wall clock.
    #[must_use]
    pub fn ahead(self, offset_ms: Arc<AtomicI64>) -> Clock {
        let wall = self.wall;
        Clock {
            wall: Arc::new(move || wall() + offset_ms.load(Ordering::Relaxed)),
            ..self
        }
    }

    /// The time of the wall clock, epoch milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> i64 {
        (self.wall)()
    }

    /// The time of the steady clock in ms, since an arbitrary moment.
    #[must_use]
    pub fn steady_ms(&self) -> i64 {
        (self.steady)()
    }
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Clock")
    }
}

/// Minimum change of the difference between the clocks that counts as a jump, in ms.
const LEAP_MS: i64 = 60_000;

/// Detects jumps of the wall clock.
#[derive(Debug, Default)]
pub(crate) struct ClockSteps(Mutex<Seen>);

#[derive(Debug, Default)]
struct Seen {
    /// Difference of wall clock and steady clock at the last measurement.
    offset: Option<i64>,
    leap: ClockStep,
}

/// Offset of the wall clock after jumps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ClockStep {
    /// Sum of the jumps forward in ms; 0 if there was none, or it was undone.
    pub(crate) ms: i64,
    /// Wall clock after the last jump.
    pub(crate) at: i64,
}

impl ClockStep {
    /// The current time to compare with `began`: without the jump if `began` precedes it. Both in epoch milliseconds.
    pub(crate) fn now_for(self, began: i64, now: i64) -> i64 {
        if began < self.at {
            now.saturating_sub(self.ms)
        } else {
            now
        }
    }
}

impl ClockSteps {
    /// Reads the clocks and records a jump of the wall clock.
    pub(crate) fn measure(&self, clock: &Clock) -> ClockStep {
        let mut seen = lock(&self.0);
        let wall = clock.now_ms();
        let offset = wall - clock.steady_ms();
        let moved = offset - seen.offset.unwrap_or(offset);
        if moved.abs() >= LEAP_MS {
            tracing::warn!(seconds = moved / 1000, "the clock of this machine was set");
            let ms = (seen.leap.ms + moved).max(0);
            seen.leap = if ms < LEAP_MS {
                ClockStep::default()
            } else {
                ClockStep { ms, at: wall }
            };
        }
        seen.offset = Some(offset);
        seen.leap
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicI64, Ordering};

    use super::*;

    #[test]
    fn a_leap_is_seen_kept_and_undone() {
        let set = Arc::new(AtomicI64::new(0));
        let clock = {
            let (set, system) = (set.clone(), Clock::system());
            Clock::that_is_set(move || system.now_ms() + set.load(Ordering::SeqCst))
        };
        let leaps = ClockSteps::default();
        let before = clock.now_ms();
        assert_eq!(leaps.measure(&clock).ms, 0);
        set.store(3_600_000, Ordering::SeqCst);
        let leap = leaps.measure(&clock);
        assert!((leap.ms - 3_600_000).abs() < 1000, "{leap:?}");
        let now = clock.now_ms();
        assert!(leap.now_for(before, now) - before < 10_000);
        assert_eq!(
            leap.now_for(now, now),
            now,
            "what begins afterwards is judged by the clock"
        );
        set.store(0, Ordering::SeqCst);
        assert_eq!(leaps.measure(&clock), ClockStep::default());
        // A clock that falls back harms nothing.
        set.store(-3_600_000, Ordering::SeqCst);
        assert_eq!(leaps.measure(&clock), ClockStep::default());
    }
}
