//! Which queue has the next turn. Tenants share solver seconds; within a queue, long solves and new jobs take turns.
//!
//! The seconds are kept in memory, by the process that spends them, and fade: what counts is the last minutes.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::jobs::attempts::attempt::{Attempt, TimeSpentOn};
use crate::jobs::model::kind::{Kind, Queue};
use crate::jobs::sync::lock;

/// Time after which a solver second counts half.
const HALF_LIFE: Duration = Duration::from_secs(60);

/// Less than this is forgotten, in s.
const FORGOTTEN: f64 = 1e-6;

/// Solver seconds of tenants and the attempts that wait at their pause points.
#[derive(Debug, Default)]
pub(crate) struct FairScheduler(Mutex<Inner>);

#[derive(Debug, Default)]
struct Inner {
    used: HashMap<Queue, Used>,
    parked: Vec<Attempt>,
}

#[derive(Debug, Clone, Copy)]
struct Used {
    /// As of `at`.
    seconds: f64,
    at: Instant,
    /// Seconds that new jobs of the queue have had since one of its long solves had a turn.
    queue_since: f64,
    /// That was one that had waited at its pause point.
    parked_was_last: bool,
}

impl Used {
    fn at(&self, now: Instant) -> f64 {
        let elapsed = now.saturating_duration_since(self.at);
        let lives = elapsed.as_secs_f64() / HALF_LIFE.as_secs_f64();
        self.seconds * 0.5_f64.powf(lives)
    }
}

/// One of the two kinds of long solves that wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LongSolve {
    /// At its pause point, with all that it has in memory.
    Parked,
    /// In the queue, between two slices.
    Begun,
}

impl FairScheduler {
    /// Puts solver time on the account of a queue.
    pub(crate) fn charge(&self, queue: &Queue, time: Duration, spent: TimeSpentOn) {
        let mut inner = self.lock();
        let now = Instant::now();
        let used = inner.used.entry(queue.clone()).or_insert(Used {
            seconds: 0.0,
            at: now,
            queue_since: 0.0,
            parked_was_last: false,
        });
        used.seconds = used.at(now) + time.as_secs_f64();
        used.at = now;
        match spent {
            TimeSpentOn::New => used.queue_since += time.as_secs_f64(),
            TimeSpentOn::Parked | TimeSpentOn::Begun => {
                used.queue_since = 0.0;
                used.parked_was_last = spent == TimeSpentOn::Parked;
            }
        }
        inner.used.retain(|_, used| used.at(now) > FORGOTTEN);
    }

    /// Queues in the order of their turns: first those of the tenant that has used the least in all, and of these the one that has.
    pub(crate) fn order(&self, mut queues: Vec<Queue>) -> Vec<Queue> {
        let inner = self.lock();
        queues.extend(inner.parked.iter().map(|attempt| attempt.queue.clone()));
        // One present for all, so that both queues of a tenant have the same sum.
        let now = Instant::now();
        let used = |queue: &Queue| inner.used.get(queue).map_or(0.0, |used| used.at(now));
        let mut keyed: Vec<_> = queues
            .into_iter()
            .map(|queue| {
                let of_kind = |kind| {
                    used(&Queue {
                        tenant: queue.tenant.clone(),
                        kind,
                    })
                };
                let of_tenant =
                    of_kind(Kind::Case) + of_kind(Kind::Rows) + of_kind(Kind::Evolution);
                ([of_tenant, used(&queue)], queue)
            })
            .collect();
        keyed.sort_by(|(a, first), (b, second)| {
            let used = a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
            used.then_with(|| first.cmp(second))
        });
        keyed.dedup_by(|a, b| a.1 == b.1);
        keyed.into_iter().map(|(_, queue)| queue).collect()
    }

    /// Have new jobs of this queue had a slice of time since one of its long solves had a turn?
    pub(crate) fn queue_had_its_share(&self, queue: &Queue, slice: Duration) -> bool {
        let inner = self.lock();
        let used = inner.used.get(queue);
        used.is_some_and(|used| used.queue_since >= slice.as_secs_f64())
    }

    /// The kinds of long solves of this queue in the order of their turns.
    pub(crate) fn long_ones(&self, queue: &Queue) -> [LongSolve; 2] {
        let inner = self.lock();
        match inner
            .used
            .get(queue)
            .is_some_and(|used| used.parked_was_last)
        {
            true => [LongSolve::Begun, LongSolve::Parked],
            false => [LongSolve::Parked, LongSolve::Begun],
        }
    }

    /// An attempt waits at its pause point from now on.
    pub(crate) fn park(&self, attempt: Attempt) {
        self.lock().parked.push(attempt);
    }

    /// The attempt of a queue that waits longest.
    pub(crate) fn resume(&self, queue: &Queue) -> Option<Attempt> {
        let mut inner = self.lock();
        let place = inner
            .parked
            .iter()
            .position(|attempt| attempt.queue == *queue)?;
        Some(inner.parked.remove(place))
    }

    /// An attempt that was told to stop, or whose solver has ended: it needs no solver time.
    pub(crate) fn resume_stopped(&self) -> Option<Attempt> {
        let mut inner = self.lock();
        let place = inner.parked.iter().position(Attempt::is_stopped)?;
        Some(inner.parked.remove(place))
    }

    /// Any attempt that waits.
    pub(crate) fn resume_any(&self) -> Option<Attempt> {
        self.lock().parked.pop()
    }

    /// Number of attempts that wait, and the bytes that they are estimated to hold.
    pub(crate) fn parked(&self) -> (usize, u64) {
        let inner = self.lock();
        let bytes = inner.parked.iter().map(Attempt::memory_bytes).sum();
        (inner.parked.len(), bytes)
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        lock(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn queue(tenant: &str, kind: Kind) -> Queue {
        Queue {
            tenant: tenant.into(),
            kind,
        }
    }

    fn names(queues: &[Queue]) -> Vec<String> {
        let name = |queue: &Queue| format!("{} {}", queue.tenant, queue.kind.name());
        queues.iter().map(name).collect()
    }

    #[test]
    fn whoever_has_used_the_least_seconds_comes_first() {
        let turns = FairScheduler::default();
        let tenants = ["a", "b", "c"]
            .map(|tenant| queue(tenant, Kind::Case))
            .to_vec();
        assert_eq!(
            names(&turns.order(tenants.clone())),
            ["a case", "b case", "c case"]
        );
        turns.charge(&tenants[0], Duration::from_secs(100), TimeSpentOn::New);
        turns.charge(&tenants[1], Duration::from_secs(1), TimeSpentOn::New);
        assert_eq!(
            names(&turns.order(tenants.clone())),
            ["c case", "b case", "a case"]
        );
        // Many short jobs weigh what they take, not how many they are.
        for _ in 0..1000 {
            turns.charge(&tenants[2], Duration::from_micros(10), TimeSpentOn::New);
        }
        assert_eq!(names(&turns.order(tenants)), ["c case", "b case", "a case"]);
    }

    #[test]
    fn jobs_and_rows_of_a_tenant_share_its_turn() {
        let turns = FairScheduler::default();
        let queues = vec![
            queue("a", Kind::Case),
            queue("a", Kind::Rows),
            queue("b", Kind::Case),
        ];
        turns.charge(&queues[1], Duration::from_secs(10), TimeSpentOn::New);
        let order = turns.order(queues.clone());
        assert_eq!(names(&order), ["b case", "a case", "a rows"]);
        turns.charge(&queues[2], Duration::from_secs(20), TimeSpentOn::New);
        let order = turns.order(queues);
        assert_eq!(names(&order), ["a case", "a rows", "b case"]);
    }

    #[test]
    fn queue_and_long_solves_of_a_tenant_take_turns() {
        let turns = FairScheduler::default();
        let (queue, slice) = (queue("a", Kind::Case), Duration::from_secs(2));
        assert!(!turns.queue_had_its_share(&queue, slice));
        turns.charge(&queue, slice, TimeSpentOn::New);
        assert!(turns.queue_had_its_share(&queue, slice));
        turns.charge(&queue, slice, TimeSpentOn::Parked);
        assert!(!turns.queue_had_its_share(&queue, slice));
        // So do those at a pause point and those in the queue.
        assert_eq!(
            turns.long_ones(&queue),
            [LongSolve::Begun, LongSolve::Parked]
        );
        turns.charge(&queue, slice, TimeSpentOn::Begun);
        assert_eq!(
            turns.long_ones(&queue),
            [LongSolve::Parked, LongSolve::Begun]
        );
    }
}
