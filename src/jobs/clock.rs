//! The clocks of the service: those of the system, or those that a test sets.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Instant;

/// A wall clock, and beside it a steady clock, which is never set. Clones show the same times.
#[derive(Clone)]
pub struct Clock {
    wall: Arc<dyn Fn() -> i64 + Send + Sync>,
    steady: Arc<dyn Fn() -> i64 + Send + Sync>,
}

impl Clock {
    /// The system's clocks.
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

    /// A clock that shows what `now_ms` says, in epoch milliseconds; time passes as it says.
    #[must_use]
    pub fn new(now_ms: impl Fn() -> i64 + Send + Sync + 'static) -> Clock {
        let wall: Arc<dyn Fn() -> i64 + Send + Sync> = Arc::new(now_ms);
        Clock {
            steady: wall.clone(),
            wall,
        }
    }

    /// A wall clock that shows what `now_ms` says, beside the steady clock of the system: as when the wall clock is set.
    #[must_use]
    pub fn that_is_set(now_ms: impl Fn() -> i64 + Send + Sync + 'static) -> Clock {
        Clock {
            wall: Arc::new(now_ms),
            ..Clock::system()
        }
    }

    /// The same clocks, the wall clock ahead by what `offset_ms` says at the time.
    #[must_use]
    pub fn ahead(self, offset_ms: Arc<AtomicI64>) -> Clock {
        let wall = self.wall;
        Clock {
            wall: Arc::new(move || wall() + offset_ms.load(Ordering::Relaxed)),
            ..self
        }
    }

    /// Epoch milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> i64 {
        (self.wall)()
    }

    /// Milliseconds since some moment, whatever becomes of the wall clock.
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
