//! The worker pool: each worker takes one turn after the other until the service drains.
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::sleep;
use uuid::Uuid;

use crate::attempts::attempt::{Attempt, SolverThread};
use crate::error::Result;
use crate::model::{Queue, State};
use crate::shared::Shared;
use crate::store::{ClaimKind, ClaimRequest};
use crate::worker::solve;

/// Interval at which an idle worker looks for jobs without being woken.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// A worker. It has at most one running solver.
#[derive(Debug)]
pub struct Worker {
    pub(crate) shared: Arc<Shared>,
    pub(crate) name: String,
    /// Whether it serves short jobs while every other worker runs a long solve.
    pub(crate) spare: bool,
    /// An idle solver thread.
    pub(crate) thread: Option<SolverThread>,
}

/// Result of one [`Worker::step`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StepReport {
    /// Whether there was a job.
    pub busy: bool,
    /// Jobs that ended, with their final states.
    pub ended: Vec<(Uuid, State)>,
    /// Jobs that returned to the queue without counting the attempt.
    pub handed_back: Vec<Uuid>,
}

impl Worker {
    /// Takes turns until the service drains.
    pub(crate) async fn run(mut self) {
        let shared = self.shared.clone();
        let recovered = shared.recovered.wait();
        let _ = shared.draining.run_until_cancelled(recovered).await;
        let wake = match self.spare {
            true => &shared.wake_spare,
            false => &shared.wake,
        };
        while !shared.draining.is_cancelled() {
            match self.step().await {
                Ok(step) if step.busy => continue,
                Ok(_) => {}
                Err(error) => tracing::error!(worker = self.name, %error, "worker step failed"),
            }
            tokio::select! {
                () = wake.notified() => {}
                () = sleep(POLL_INTERVAL) => {}
                () = shared.draining.cancelled() => {}
            }
        }
    }

    /// Takes one turn: claims and solves jobs, and records their outcomes. Called by the pool and by tests.
    ///
    /// # Errors
    /// The database failed; claimed jobs are released if possible, or reaped when their leases expire.
    pub async fn step(&mut self) -> Result<StepReport> {
        let Some(mut attempt) = self.next_turn().await? else {
            return Ok(StepReport::default());
        };
        let mut step = StepReport {
            busy: true,
            ..StepReport::default()
        };
        if let Err(error) = self.turn(&mut attempt, &mut step).await {
            self.give_up(&mut attempt).await;
            return Err(error);
        }
        Ok(step)
    }
}

/// Maximum sum of the expected solve times of a group, in µs.
const GROUP_COST_US: u64 = 200_000;

impl Worker {
    /// Claims the next attempt, in the order of the fair scheduler. Within a queue, new jobs and begun sweeps alternate.
    pub(crate) async fn next_turn(&self) -> Result<Option<Attempt>> {
        let shared = &self.shared;
        let long = shared.long_solves.load(Ordering::Acquire);
        if shared.draining.is_cancelled() || (self.spare && long < shared.options.workers) {
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
    ) -> Result<Option<Attempt>> {
        let shared = &self.shared;
        let options = &shared.options;
        let slice_us = u64::try_from(options.slice.as_micros()).unwrap_or(u64::MAX);
        // Short queues are divided among the workers.
        let share = usize::try_from(waiting).unwrap_or(usize::MAX);
        let share = share.div_ceil(shared.all_workers().max(1));
        // If two suspects ran at the same time, the one that crashes the process would not be known.
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
        Ok(Some(solve::new_attempt(
            shared,
            queue.clone(),
            claims,
            suspect,
        )))
    }
}
