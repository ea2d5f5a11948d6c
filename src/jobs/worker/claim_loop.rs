//! What a worker claims next.

use crate::jobs::attempts::attempt::Attempt;
use crate::jobs::error::JobsError;
use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::{ClaimKind, ClaimRequest};
use crate::jobs::worker::begin;
use crate::jobs::worker::pool::Worker;

/// Largest sum of expected solve times in a group, in µs.
const GROUP_COST_US: u64 = 200_000;

impl Worker {
    /// What to work on next, by the turns of the tenants. Within a queue, new jobs and begun sweeps take turns.
    pub(crate) async fn next_turn(&self) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        if shared.draining.is_cancelled() || (self.spare && !shared.all_workers_are_long()) {
            return Ok(None);
        }
        let queues = shared.store.queues().await?;
        for (queue, waiting) in shared.turns.order(queues) {
            let mut kinds = [ClaimKind::New, ClaimKind::Begun];
            if shared
                .turns
                .queue_had_its_share(&queue, shared.options.slice)
            {
                kinds.reverse();
            }
            for kind in kinds {
                if let Some(attempt) = self.claim((&queue, waiting), kind).await? {
                    return Ok(Some(attempt));
                }
            }
        }
        Ok(None)
    }

    async fn claim(
        &self,
        (queue, waiting): (&Queue, u64),
        kind: ClaimKind,
    ) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        let options = &shared.options;
        let slice_us = u64::try_from(options.slice.as_micros()).unwrap_or(u64::MAX);
        // Each worker gets some of a short queue.
        let share = usize::try_from(waiting).unwrap_or(usize::MAX);
        let share = share.div_ceil(shared.all_workers().max(1));
        // Of two suspects that are solved at the same time, nobody would know which one has killed the process.
        let suspect = shared.suspect.clone().try_lock_owned().ok();
        let request = ClaimRequest {
            worker: &self.name,
            queue,
            kind,
            jobs: share.clamp(1, options.group_max.max(1)),
            waiting,
            cost_us: GROUP_COST_US,
            each_slice_us: self.spare.then_some(slice_us),
            suspects: suspect.is_some(),
            lease: shared.lease(),
            now: shared.now_ms(),
            late_before: shared.now_ms().saturating_sub(shared.clock_step().ms),
        };
        let mut claims = shared.store.claim(&request).await?;
        if claims.is_empty() {
            return Ok(None);
        }
        if !options.cache {
            claims.iter_mut().for_each(|claim| claim.cache_key = None);
        }
        let suspect = suspect.filter(|_| claims.iter().any(|claim| claim.suspect));
        Ok(Some(begin::take_up(shared, queue.clone(), claims, suspect)))
    }
}
