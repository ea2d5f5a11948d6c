//! Fair scheduling: tenants share solver time, and within a queue begun sweeps and new jobs alternate.
//!
//! The accounts are in the memory of the process that spends the time, and decay: only the last minutes count.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::model::{Kind, Queue};
use crate::sync::lock;

/// Half-life of an account.
const HALF_LIFE: Duration = Duration::from_secs(60);

/// Accounts below this are removed, in s.
const FORGOTTEN: f64 = 1e-6;

/// Solver time by queue.
#[derive(Debug, Default)]
pub(crate) struct FairScheduler(Mutex<HashMap<Queue, Used>>);

#[derive(Debug, Clone, Copy)]
struct Used {
    /// Solver time in s at the time `at`.
    seconds: f64,
    at: Instant,
    /// Solver time of new jobs since the last turn of a begun sweep, in s.
    queue_since: f64,
}

impl Used {
    fn at(&self, now: Instant) -> f64 {
        let elapsed = now.saturating_duration_since(self.at);
        let lives = elapsed.as_secs_f64() / HALF_LIFE.as_secs_f64();
        self.seconds * 0.5_f64.powf(lives)
    }
}

impl FairScheduler {
    /// Charges solver time to a queue; `was_begun` if a sweep used it that was in the queue between two slices.
    pub(crate) fn charge(&self, queue: &Queue, time: Duration, was_begun: bool) {
        let mut queues = lock(&self.0);
        let now = Instant::now();
        let used = queues.entry(queue.clone()).or_insert(Used {
            seconds: 0.0,
            at: now,
            queue_since: 0.0,
        });
        used.seconds = used.at(now) + time.as_secs_f64();
        used.at = now;
        match was_begun {
            false => used.queue_since += time.as_secs_f64(),
            true => used.queue_since = 0.0,
        }
        queues.retain(|_, used| used.at(now) > FORGOTTEN);
    }

    /// Sorts queues by their turn: first by the solver time of the tenant, then by that of the queue.
    pub(crate) fn order(&self, mut queues: Vec<(Queue, u64)>) -> Vec<(Queue, u64)> {
        let accounts = lock(&self.0);
        // One time for all, so that all queues of a tenant have the same sum.
        let now = Instant::now();
        let used = |queue: &Queue| accounts.get(queue).map_or(0.0, |used| used.at(now));
        let keys = |queue: &Queue| {
            let of_kind = |kind| {
                used(&Queue {
                    tenant: queue.tenant.clone(),
                    kind,
                })
            };
            let of_tenant = of_kind(Kind::Case) + of_kind(Kind::Rows) + of_kind(Kind::Evolution);
            [of_tenant, used(queue)]
        };
        queues.sort_by(|a, b| {
            let (first, second) = (keys(&a.0), keys(&b.0));
            let used = first[0].total_cmp(&second[0]);
            let used = used.then(first[1].total_cmp(&second[1]));
            used.then_with(|| a.0.cmp(&b.0))
        });
        queues
    }

    /// Whether new jobs of this queue have used a time slice since the last turn of a begun sweep.
    pub(crate) fn queue_had_its_share(&self, queue: &Queue, slice: Duration) -> bool {
        let queues = lock(&self.0);
        let used = queues.get(queue);
        used.is_some_and(|used| used.queue_since >= slice.as_secs_f64())
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

    fn order(turns: &FairScheduler, queues: &[Queue]) -> Vec<String> {
        let queues = queues.iter().map(|queue| (queue.clone(), 1)).collect();
        let name = |(queue, _): (Queue, u64)| format!("{} {}", queue.tenant, queue.kind.name());
        turns.order(queues).into_iter().map(name).collect()
    }

    #[test]
    fn whoever_has_used_the_least_seconds_comes_first() {
        let turns = FairScheduler::default();
        let tenants = ["a", "b", "c"]
            .map(|tenant| queue(tenant, Kind::Case))
            .to_vec();
        assert_eq!(order(&turns, &tenants), ["a case", "b case", "c case"]);
        turns.charge(&tenants[0], Duration::from_secs(100), false);
        turns.charge(&tenants[1], Duration::from_secs(1), false);
        assert_eq!(order(&turns, &tenants), ["c case", "b case", "a case"]);
        // Many short jobs weigh what they take, not how many they are.
        for _ in 0..1000 {
            turns.charge(&tenants[2], Duration::from_micros(10), false);
        }
        assert_eq!(order(&turns, &tenants), ["c case", "b case", "a case"]);
    }

    #[test]
    fn jobs_and_rows_of_a_tenant_share_its_turn() {
        let turns = FairScheduler::default();
        let queues = vec![
            queue("a", Kind::Case),
            queue("a", Kind::Rows),
            queue("b", Kind::Case),
        ];
        turns.charge(&queues[1], Duration::from_secs(10), false);
        assert_eq!(order(&turns, &queues), ["b case", "a case", "a rows"]);
        turns.charge(&queues[2], Duration::from_secs(20), false);
        assert_eq!(order(&turns, &queues), ["a case", "a rows", "b case"]);
    }

    #[test]
    fn new_jobs_and_begun_sweeps_of_a_tenant_take_turns() {
        let turns = FairScheduler::default();
        let (queue, slice) = (queue("a", Kind::Case), Duration::from_secs(2));
        assert!(!turns.queue_had_its_share(&queue, slice));
        turns.charge(&queue, slice, false);
        assert!(turns.queue_had_its_share(&queue, slice));
        turns.charge(&queue, slice, true);
        assert!(!turns.queue_had_its_share(&queue, slice));
    }
}
