//! Batches: many jobs queued together, followed, read and cancelled as one.

use std::collections::BTreeMap;
use std::time::Duration;

use bytes::Bytes;
use tokio::time::{Instant, timeout_at};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::{Job, State};
use crate::jobs::watch::Reason;
use crate::jobs::{Jobs, LOOK_AGAIN};

/// Solutions read at once: once they are this large together, the rest is left for the next page.
const PAGE_BYTES: usize = 1 << 20;
/// Jobs removed in one transaction.
pub(super) const DELETED_AT_ONCE: u32 = 500;
/// Jobs cancelled in one transaction.
const CANCELLED_AT_ONCE: u32 = 2000;
/// Pause between two looks at a job that a reader of results waits for.
const LOOK_PAUSE: Duration = Duration::from_millis(10);

/// What is known of one batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// UUIDv7.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: String,
    /// Time of submission, epoch milliseconds.
    pub created_at: i64,
    /// Number of jobs it was made of.
    pub count: u32,
    /// Number of faulty cases that were left out.
    pub rejected: u32,
    /// Number of jobs in each state; every state is there.
    pub states: BTreeMap<State, u64>,
}

impl Batch {
    /// Number of jobs in a state.
    #[must_use]
    pub fn in_state(&self, state: State) -> u64 {
        self.states.get(&state).copied().unwrap_or(0)
    }

    /// Number of jobs that have ended, and of all jobs that are still there.
    #[must_use]
    pub fn ended(&self) -> (u64, u64) {
        let ended = self.states.iter().filter(|(state, _)| state.ended());
        (
            ended.map(|(_, jobs)| jobs).sum(),
            self.states.values().sum(),
        )
    }
}

/// One job of a batch with what is needed to show its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Place of the case in what was sent, counted from 0.
    pub index: u32,
    /// The job.
    pub job: Job,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
    /// What there is to show; `None` until the job has succeeded.
    pub result: Option<LineResult>,
    pub(super) key: Option<String>,
}

/// The result of one job of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LineResult {
    /// The solution as JSON text.
    Solution(Bytes),
    /// It was removed while the lines were read: the job has expired or was deleted.
    Gone,
    /// It cannot be read.
    Unreadable,
}

impl LineResult {
    /// Size in bytes of what is there.
    fn bytes(&self) -> usize {
        match self {
            LineResult::Solution(text) => text.len(),
            LineResult::Gone | LineResult::Unreadable => 0,
        }
    }
}

impl Jobs {
    /// Looks at a batch.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], or a failed database.
    pub async fn batch(&self, id: Uuid) -> Result<Batch, JobsError> {
        let batch = self.shared.store.batch(id).await?;
        match batch.filter(|batch| *batch.tenant == *self.tenant) {
            Some(batch) => Ok(batch),
            None => Err(self.missing(id, JobsError::BatchNotFound).await),
        }
    }

    /// Cancels every job of a batch that has not ended: queued ones end at once, running ones at the next tick of
    /// their solvers. Returns the batch as it then is.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], or a failed database.
    pub async fn cancel_batch(&self, id: Uuid) -> Result<Batch, JobsError> {
        self.batch(id).await?;
        loop {
            let now = self.shared.now_ms();
            let store = &self.shared.store;
            let changed = store.cancel_batch(id, CANCELLED_AT_ONCE, now).await?;
            for (job, state) in &changed {
                if state.ended() {
                    self.shared.metrics.ended(*state, 1);
                    self.shared.announce(*job);
                } else if let Some(watch) = self.shared.running().get(job) {
                    watch.stop(Reason::Cancel);
                }
            }
            if changed.len() < CANCELLED_AT_ONCE as usize {
                break;
            }
        }
        self.batch(id).await
    }

    /// Removes a batch of which every job has ended, with its jobs, their cases and their results. The jobs go in portions, so that
    /// other writers are not held up; if the process dies meanwhile, the rest is still there and can be removed again.
    ///
    /// # Errors
    /// [`JobsError::BatchNotEnded`], [`JobsError::BatchNotFound`], or a failed database.
    pub async fn delete_batch(&self, id: Uuid) -> Result<(), JobsError> {
        let (ended, all) = self.batch(id).await?.ended();
        if ended < all {
            return Err(JobsError::BatchNotEnded(all - ended));
        }
        loop {
            let gone = self.shared.store.delete_ended(id, DELETED_AT_ONCE).await?;
            self.shared.collect_blobs().await;
            if gone < u64::from(DELETED_AT_ONCE) {
                break;
            }
        }
        self.shared.store.delete_empty_batch(id).await?;
        tracing::info!(batch = %id, jobs = all, "batch deleted");
        Ok(())
    }

    /// The next jobs of a batch after the job `after`, in the order they were sent, at most `limit`, fewer if their
    /// results are large. With `until`, only jobs that have ended are returned as long as that time is not reached, and at
    /// least one is waited for. Empty at the end of the batch.
    ///
    /// # Errors
    /// A failed database.
    pub async fn batch_lines(
        &self,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        until: Option<Instant>,
    ) -> Result<Vec<Line>, JobsError> {
        let until = until.unwrap_or_else(Instant::now);
        loop {
            // Subscribe first, then look: what ends in between is announced.
            let mut ended = self.shared.ended.subscribe();
            let mut lines = self.shared.store.batch_lines(id, after, limit).await?;
            lines.retain(|line| *line.job.tenant == *self.tenant);
            let waiting = Instant::now() < until && !self.shared.draining.is_cancelled();
            if waiting {
                let done = lines
                    .iter()
                    .take_while(|line| line.job.state.ended())
                    .count();
                if done == 0
                    && let Some(first) = lines.first().map(|line| line.job.id)
                {
                    while Instant::now() < until
                        && !self.shared.draining.is_cancelled()
                        && self
                            .recent(first, LOOK_PAUSE)
                            .await
                            .is_ok_and(|job| !job.state.ended())
                    {
                        let look = until.min(Instant::now() + LOOK_AGAIN);
                        // A lagging receiver may have missed the announcement, so it looks again as well.
                        let announced =
                            async { while ended.recv().await.is_ok_and(|ended| ended != first) {} };
                        tokio::select! {
                            _ = timeout_at(look, announced) => {}
                            () = self.shared.draining.cancelled() => {}
                        }
                        // Many jobs end in the same moment; one look serves all of them.
                        tokio::time::sleep(LOOK_PAUSE).await;
                        ended = ended.resubscribe();
                    }
                    continue;
                }
                lines.truncate(done);
            }
            let mut bytes = 0;
            for place in 0..lines.len() {
                let line = &mut lines[place];
                if let Some(key) = &line.key {
                    line.result = Some(self.line_result(line.job.id, key).await?);
                }
                bytes += line.result.as_ref().map_or(0, LineResult::bytes);
                if bytes >= PAGE_BYTES {
                    lines.truncate(place + 1);
                    break;
                }
            }
            return Ok(lines);
        }
    }

    /// The result of a line that lies outside the table. What cannot be read costs its own line and no other.
    async fn line_result(&self, id: Uuid, key: &str) -> Result<LineResult, JobsError> {
        Ok(match self.shared.results.solution(key).await {
            Ok(solution) => LineResult::Solution(solution),
            Err(error) => match self.gone_meanwhile(id, error).await {
                JobsError::Expired => LineResult::Gone,
                error => {
                    tracing::error!(job = %id, %error, "a stored result cannot be read");
                    LineResult::Unreadable
                }
            },
        })
    }
}
