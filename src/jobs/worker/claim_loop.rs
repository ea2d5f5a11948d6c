//! What a worker does next: a new claim, or a solve that waits for its next turn.

use crate::jobs::attempts::attempt::Attempt;
use crate::jobs::attempts::fair_scheduler::LongSolve;
use crate::jobs::error::JobsError;
use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::{Claim, ClaimKind, ClaimRequest};
use crate::jobs::worker::begin;
use crate::jobs::worker::pool::Worker;

/// Largest sum of expected solve times in a group, in µs.
const GROUP_COST_US: u64 = 200_000;

impl Worker {
    /// What to work on next, by the turns of the tenants.
    pub(crate) async fn next_turn(&self) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        let turns = &shared.turns;
        if let Some(attempt) = turns.resume_stopped() {
            return Ok(Some(attempt));
        }
        if shared.draining.is_cancelled() {
            return Ok(turns.resume_any());
        }
        let queues = shared.store.queues().await?;
        let slice = shared.options.slice;
        for queue in turns.order(queues) {
            let long_first = turns.queue_had_its_share(&queue, slice);
            if long_first && let Some(attempt) = self.next_long(&queue).await? {
                return Ok(Some(attempt));
            }
            let claims = self.claim(&queue, ClaimKind::New).await?;
            if !claims.is_empty() {
                return Ok(Some(begin::take_up(shared, queue, claims)));
            }
            if let Some(attempt) = self.next_long(&queue).await? {
                return Ok(Some(attempt));
            }
        }
        Ok(None)
    }

    /// A solve of a queue that waits for its next turn, at its pause point or in the queue.
    async fn next_long(&self, queue: &Queue) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        for long in shared.turns.long_ones(queue) {
            match long {
                LongSolve::Parked => {
                    if let Some(attempt) = shared.turns.resume(queue) {
                        return Ok(Some(attempt));
                    }
                }
                LongSolve::Begun => {
                    let claims = self.claim(queue, ClaimKind::Begun).await?;
                    if !claims.is_empty() {
                        return Ok(Some(begin::take_up(shared, queue.clone(), claims)));
                    }
                }
            }
        }
        Ok(None)
    }

    async fn claim(&self, queue: &Queue, kind: ClaimKind) -> Result<Vec<Claim>, JobsError> {
        let shared = &self.shared;
        let options = &shared.options;
        let full = shared.turns.parked().0 >= options.parked_max;
        let slice_us = u64::try_from(options.slice.as_micros()).unwrap_or(u64::MAX);
        let request = ClaimRequest {
            worker: &self.name,
            queue,
            kind,
            jobs: options.group_max.max(1),
            cost_us: GROUP_COST_US,
            // With no pause point free, only what should be done, or come to its next cut, within a slice.
            each_slice_us: full.then_some(slice_us),
            workers: shared.all_workers(),
            lease: shared.lease(),
            now: shared.now_ms(),
            late_before: shared.now_ms().saturating_sub(shared.clock_step().ms),
        };
        let mut claims = shared.store.claim(&request).await?;
        if !options.cache {
            claims.iter_mut().for_each(|claim| claim.cache_key = None);
        }
        Ok(claims)
    }
}
