//! Workers: each takes one turn after the other until the service drains.
use std::sync::Arc;
use std::time::Duration;

use tokio::time::sleep;
use uuid::Uuid;

use crate::attempts::attempt::{Attempt, SolverThread};
use crate::error::Result;
use crate::model::{Queue, State};
use crate::shared::Shared;
use crate::store::{ClaimKind, ClaimRequest};
use crate::worker::solve;

/// How often an idle worker asks for jobs although nothing has woken it.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// One worker. It has at most one solver at work.
#[derive(Debug)]
pub struct Worker {
    pub(crate) shared: Arc<Shared>,
    pub(crate) name: String,
    /// It serves short jobs while every other worker is at a long solve.
    pub(crate) spare: bool,
    /// A thread without work.
    pub(crate) thread: Option<SolverThread>,
}

/// What became of one [`Worker::step`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StepReport {
    /// There was something to be done.
    pub busy: bool,
    /// Jobs that ended, with their states.
    pub ended: Vec<(Uuid, State)>,
    /// Jobs that went back to the queue, their attempts uncounted.
    pub handed_back: Vec<Uuid>,
    /// Jobs that had been given away; their outcomes were discarded.
    pub lost: Vec<Uuid>,
}

impl Worker {
    pub(crate) fn new(shared: Arc<Shared>, name: &str) -> Result<Worker> {
        Ok(Worker {
            thread: Some(SolverThread::start(name)?),
            shared,
            name: name.to_owned(),
            spare: false,
        })
    }

    /// Steps until the service drains.
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

    /// Takes one turn: claims, solves, and writes down what became of each job. The pool calls this, and tests do.
    ///
    /// # Errors
    /// The database failed; claimed jobs are given back if that is possible, or taken back when their leases run out.
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

/// Largest sum of expected solve times in a group, in µs.
const GROUP_COST_US: u64 = 200_000;

impl Worker {
    /// What to work on next, by the turns of the tenants. Within a queue, new jobs and begun sweeps take turns.
    pub(crate) async fn next_turn(&self) -> Result<Option<Attempt>> {
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
    ) -> Result<Option<Attempt>> {
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
        Ok(Some(solve::take_up(shared, queue.clone(), claims, suspect)))
    }
}
