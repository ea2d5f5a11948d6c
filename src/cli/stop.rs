//! How a service stops: the signals, and the time that each step may take.
//!
//! Steps, counted from the signal: not ready (`/readyz` is 503) while connections are still accepted, so that a load
//! balancer sees it before the port is gone; the port closes and open requests end; running jobs get what is left of
//! their grace period, then go back to the queue uncounted; the data folder is closed. Whatever hangs, the process is
//! gone at the last moment of the schedule: what is stored is safe at any time, as it is when the process is killed.

use std::process::exit;
use std::time::Duration;

use anyhow::Context;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::Instant;

/// How long open requests may take to end once the port is closed, at least and at most.
const REQUESTS_END_WITHIN: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(5)];
/// What the steps may take beyond the grace period.
const BEYOND_GRACE: Duration = Duration::from_secs(5);
/// What the steps need at least after the port is closed.
const BEYOND_DRAIN: Duration = Duration::from_secs(3);
/// Kept for the last step: the exit itself.
const LAST_STEP: Duration = Duration::from_millis(500);
/// Exit code of a process that was told to stop twice, as shells count a SIGINT.
const STOPPED_AT_ONCE: i32 = 130;

/// When which step of a stop is over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Schedule {
    /// The port closes.
    pub port_closes: Instant,
    /// Open requests are cut off.
    pub requests_end: Instant,
    /// Running jobs go back to the queue.
    pub grace_ends: Instant,
    /// Waiting for the data folder to close ends.
    pub folder_closed: Instant,
    last_moment: Instant,
}

impl Schedule {
    /// The schedule of a stop that begins now.
    pub(super) fn new(drain: Duration, grace: Duration) -> Schedule {
        let now = Instant::now();
        let [least, most] = REQUESTS_END_WITHIN;
        let last_moment = now + (grace + BEYOND_GRACE).max(drain + BEYOND_DRAIN);
        let folder_closed = last_moment - LAST_STEP;
        Schedule {
            port_closes: now + drain,
            requests_end: (now + drain + grace.clamp(least, most)).min(folder_closed - LAST_STEP),
            grace_ends: now + grace,
            folder_closed,
            last_moment,
        }
    }

    /// Ends the process with this exit code at the last moment, from a thread that needs nothing of the async runtime.
    pub(super) fn enforce(self, code: u8) {
        let enforced = std::thread::Builder::new().name("railhead-stop".to_owned());
        let enforced = enforced.spawn(move || {
            std::thread::sleep(self.last_moment.saturating_duration_since(Instant::now()));
            exit(code.into());
        });
        if let Err(error) = enforced {
            tracing::warn!(%error, "the time of the stop is not limited");
        }
    }
}

/// The signals that stop a service.
pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    pub(super) fn listen() -> anyhow::Result<Signals> {
        Ok(Signals {
            terminate: signal(SignalKind::terminate()).context("SIGTERM cannot be received")?,
            interrupt: signal(SignalKind::interrupt()).context("SIGINT cannot be received")?,
        })
    }

    /// The name of the next one.
    pub(super) async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }

    /// Ends the process at the next one.
    pub(super) fn end_at_next(mut self) {
        tokio::spawn(async move {
            let name = self.next().await;
            tracing::warn!(signal = name, "stopping at once");
            exit(STOPPED_AT_ONCE);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_ends_five_seconds_after_the_grace_period_or_three_after_the_drain() {
        let seconds = Duration::from_secs;
        for (drain, grace, last) in [(0, 0, 5), (2, 0, 5), (2, 10, 15), (30, 10, 33)] {
            let schedule = Schedule::new(seconds(drain), seconds(grace));
            let begun = schedule.port_closes.checked_sub(seconds(drain)).unwrap();
            assert_eq!(
                schedule.last_moment - begun,
                seconds(last),
                "{drain} {grace}"
            );
            assert!(schedule.port_closes < schedule.requests_end);
            assert!(schedule.requests_end < schedule.last_moment);
            assert!(schedule.grace_ends < schedule.folder_closed);
        }
    }
}
