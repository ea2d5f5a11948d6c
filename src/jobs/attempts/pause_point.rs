//! Where a solver is paused while others have their turn.
//!
//! The thread of the solver passes the pause point at every tick. A closed pause point holds it there, with everything that it has in memory,
//! until it is opened again. The pause is no part of the solve time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::Notify;

use crate::jobs::sync::lock;

/// The pause point of the threads of one attempt.
#[derive(Debug, Default)]
pub struct PausePoint {
    closed: AtomicBool,
    waiting: Mutex<PauseTime>,
    /// Wakes the solver.
    opened: Condvar,
    /// Tells the async side that the solver waits.
    reached: Notify,
}

#[derive(Debug, Default)]
struct PauseTime {
    /// Threads that wait, and since when there is one.
    threads: u32,
    since: Option<Instant>,
    /// Earlier waits, all together; one of several threads counts once.
    before: Duration,
}

impl PausePoint {
    /// Holds the solver at its next tick.
    pub(crate) fn close(&self) {
        self.closed.store(true, Ordering::Release);
    }

    /// Lets the solver go on.
    pub(crate) fn open(&self) {
        self.closed.store(false, Ordering::Release);
        drop(self.lock());
        self.opened.notify_all();
    }

    /// Wakes a waiting solver, so that it checks again whether it was told to stop.
    pub(crate) fn nudge(&self) {
        drop(self.lock());
        self.opened.notify_all();
    }

    /// Called by the solver: waits while the pause point is closed and the solver has not been told to stop.
    pub(crate) fn pass(&self, stopped: impl Fn() -> bool) {
        if !self.closed.load(Ordering::Acquire) {
            return;
        }
        let mut waiting = self.lock();
        waiting.threads += 1;
        let since = *waiting.since.get_or_insert_with(Instant::now);
        self.reached.notify_one();
        while self.closed.load(Ordering::Acquire) && !stopped() {
            waiting = self
                .opened
                .wait(waiting)
                .unwrap_or_else(PoisonError::into_inner);
        }
        waiting.threads -= 1;
        if waiting.threads == 0 {
            waiting.since = None;
            waiting.before += since.elapsed();
        }
    }

    /// The solver waits.
    pub(crate) fn holds(&self) -> bool {
        self.lock().since.is_some()
    }

    /// Resolves once the solver waits.
    pub(crate) async fn reached(&self) {
        while !self.holds() {
            self.reached.notified().await;
        }
    }

    /// How long the solver has waited in all.
    pub(crate) fn waited(&self) -> Duration {
        let waiting = self.lock();
        let now = waiting
            .since
            .map_or(Duration::ZERO, |since| since.elapsed());
        waiting.before + now
    }

    fn lock(&self) -> MutexGuard<'_, PauseTime> {
        lock(&self.waiting)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::AtomicU32;

    use super::*;

    #[tokio::test]
    async fn a_closed_gate_holds_the_solver_and_its_clock() {
        let pause_point = Arc::new(PausePoint::default());
        let passed = Arc::new(AtomicU32::new(0));
        let stop = Arc::new(AtomicBool::new(false));
        pause_point.close();
        let solver = std::thread::spawn({
            let (pause_point, passed, stop) = (pause_point.clone(), passed.clone(), stop.clone());
            move || {
                while !stop.load(Ordering::SeqCst) {
                    pause_point.pass(|| stop.load(Ordering::SeqCst));
                    passed.fetch_add(1, Ordering::SeqCst);
                }
            }
        });
        pause_point.reached().await;
        assert_eq!(passed.load(Ordering::SeqCst), 0);
        std::thread::sleep(Duration::from_millis(5));
        pause_point.open();
        while passed.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
        assert!(pause_point.waited() >= Duration::from_millis(5));
        // A solver that is told to stop does not wait for its turn.
        pause_point.close();
        pause_point.reached().await;
        stop.store(true, Ordering::SeqCst);
        pause_point.nudge();
        solver.join().unwrap();
    }

    #[test]
    fn a_wait_of_several_threads_counts_once() {
        let point = PausePoint::default();
        let begun = Instant::now();
        point.close();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| point.pass(|| false));
            }
            while point.lock().threads < 4 {
                std::thread::yield_now();
            }
            std::thread::sleep(Duration::from_millis(20));
            point.open();
        });
        let waited = point.waited();
        assert!(
            waited >= Duration::from_millis(20) && waited <= begun.elapsed(),
            "{waited:?}"
        );
        assert!(!point.holds());
    }
}
