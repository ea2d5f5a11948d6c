//! Batches: many cases checked one by one, queued together, followed and cancelled as one.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use opentelemetry::KeyValue;
use serde_json::Value;
use tokio::time::{Instant, timeout_at};
use uuid::Uuid;

use crate::contact::error::Fault;
use crate::jobs::error::JobsError;
use crate::jobs::job::{Job, State};
use crate::jobs::spool::{Card, Spool};
use crate::jobs::store::{Begun, NewBatch, NewJob};
use crate::jobs::watch::Reason;
use crate::jobs::wishes::Wishes;
use crate::jobs::{Jobs, LOOK_AGAIN, cost_us, created_at, idempotency, outputs_text};

/// Jobs queued in one transaction.
const CHUNK_JOBS: usize = 1000;
/// Bytes of cases queued in one transaction, the last case beyond them included.
const CHUNK_BYTES: usize = 4 << 20;
/// Faulty cases whose faults are kept; further ones are only counted.
const FAULTY_KEPT: usize = 1000;
/// Solutions read at once: once they are this large together, the rest is left for the next page.
const PAGE_BYTES: usize = 1 << 20;
/// Jobs removed in one transaction.
pub(super) const DELETED_AT_ONCE: u32 = 500;
/// Pause between two looks at a batch that another request is filling.
const FILLING_PAUSE: Duration = Duration::from_millis(50);
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

/// A faulty case of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultyCase {
    /// Place of the case in what was sent, counted from 0.
    pub index: u32,
    /// Line of the text on which it stands, counted from 1, if cases are lines.
    pub line: Option<u64>,
    /// Every fault of the case.
    pub faults: Vec<Fault>,
}

/// A batch in the making: checked cases wait in a file of the data folder.
#[derive(Debug)]
pub struct Draft {
    spool: Spool,
    digest: blake3::Hasher,
    /// Cases seen so far.
    pub cases: u32,
    /// Faulty ones among them.
    pub rejected: u32,
    /// The first faulty ones.
    pub faulty: Vec<FaultyCase>,
    /// What is wished for all jobs.
    pub wishes: Wishes,
}

impl Draft {
    /// Checks one more case and keeps it if it has no fault. `case` is what `text` says, or why it says nothing.
    ///
    /// # Errors
    /// The file could not be written.
    pub fn add(
        &mut self,
        jobs: &Jobs,
        line: Option<u64>,
        text: &[u8],
        case: Result<Value, String>,
    ) -> Result<(), JobsError> {
        let index = self.cases;
        self.cases += 1;
        let checked = match &case {
            Ok(case) => {
                self.digest.update(&idempotency::digest(case));
                jobs.check(case).map_err(|error| error.0)
            }
            Err(reason) => {
                self.digest.update(text);
                Err(vec![Fault {
                    pointer: String::new(),
                    detail: reason.clone(),
                }])
            }
        };
        match checked {
            Ok(problem) => {
                let card = Card {
                    index,
                    method: problem.method.name().to_owned(),
                    outputs: outputs_text(&problem.outputs),
                    cost_us: cost_us(&problem),
                    digest: problem.digest,
                    name: problem.name,
                    labels: problem.labels,
                };
                self.spool
                    .push(&card, text)
                    .map_err(|source| jobs.spool_failed(source))
            }
            Err(faults) => {
                self.rejected += 1;
                if self.faulty.len() < FAULTY_KEPT {
                    self.faulty.push(FaultyCase {
                        index,
                        line,
                        faults,
                    });
                }
                Ok(())
            }
        }
    }
}

impl Jobs {
    /// An empty batch.
    ///
    /// # Errors
    /// [`JobsError::Draining`], or the data folder cannot be written.
    pub fn draft(&self) -> Result<Draft, JobsError> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        let spool = Spool::new(&self.shared.options.data_dir);
        Ok(Draft {
            spool: spool.map_err(|source| self.spool_failed(source))?,
            digest: blake3::Hasher::new(),
            cases: 0,
            rejected: 0,
            faulty: Vec::new(),
            wishes: Wishes::default(),
        })
    }

    /// Queues the good cases of a draft. Once this returns all of them survive the death of the process; if it fails,
    /// none of them will be there. Workers may begin before it returns.
    ///
    /// # Errors
    /// [`JobsError::QueueFull`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`], or a failed database.
    pub async fn submit_batch(
        &self,
        draft: Draft,
        idempotency_key: Option<String>,
    ) -> Result<Batch, JobsError> {
        let span = self.submitting();
        let traceparent = span.traceparent();
        let submitted = self.store_batch(draft, idempotency_key, traceparent);
        span.end(submitted.await, |batch| {
            vec![
                KeyValue::new("railhead.batch.id", batch.id.to_string()),
                KeyValue::new("railhead.batch.jobs", i64::from(batch.count)),
            ]
        })
    }

    async fn store_batch(
        &self,
        draft: Draft,
        idempotency_key: Option<String>,
        traceparent: Option<Arc<str>>,
    ) -> Result<Batch, JobsError> {
        let id = Uuid::now_v7();
        let digest = *draft.digest.finalize().as_bytes();
        let new = NewBatch {
            id,
            tenant: self.tenant.clone(),
            created_at: created_at(id),
            count: draft.cases - draft.rejected,
            rejected: draft.rejected,
            idempotency: idempotency_key.map(|key| (key, digest)),
        };
        loop {
            if self.shared.draining.is_cancelled() {
                return Err(JobsError::Draining);
            }
            match self.noted(self.shared.store.begin_batch(&new).await)? {
                Begun::Created => break,
                Begun::Existing(id) => return self.batch(id).await,
                Begun::Conflict => return Err(JobsError::IdempotencyConflict),
                Begun::Unfinished => tokio::time::sleep(FILLING_PAUSE).await,
            }
        }
        // A client that hangs up must not leave a batch half filled, so the filling goes on without it.
        let jobs = self.clone();
        let filled = tokio::spawn(async move {
            let filled = jobs
                .fill(&new, draft.spool, draft.wishes, traceparent)
                .await;
            if filled.is_err()
                && let Err(error) = jobs.drop_batch(new.id).await
            {
                tracing::warn!(%error, "an incomplete batch is left until the next start");
            }
            filled
        });
        let filled = filled
            .await
            .map_err(|error| JobsError::Damaged(error.to_string()))?;
        self.noted(filled)?;
        self.batch(id).await
    }

    async fn fill(
        &self,
        new: &NewBatch,
        spool: Spool,
        wishes: Wishes,
        traceparent: Option<Arc<str>>,
    ) -> Result<(), JobsError> {
        self.admit(u64::from(new.count)).await?;
        let mut reader = spool
            .into_reader()
            .map_err(|source| self.spool_failed(source))?;
        loop {
            let taken = tokio::task::spawn_blocking(move || {
                let cases = reader.take(CHUNK_JOBS, CHUNK_BYTES);
                (reader, cases)
            });
            let (back, cases) = taken
                .await
                .map_err(|error| JobsError::Damaged(error.to_string()))?;
            reader = back;
            let cases = cases.map_err(|source| self.spool_failed(source))?;
            if cases.is_empty() {
                break;
            }
            let mut some: Vec<_> = cases
                .into_iter()
                .map(|(card, case)| {
                    let traceparent = traceparent.clone();
                    (card.index, self.new_job(card, case, wishes, traceparent))
                })
                .collect();
            if !wishes.fresh {
                self.find_sources(some.iter_mut().map(|(_, job)| job))
                    .await?;
            }
            let ended = self.shared.store.enqueue_many(new.id, &some).await?;
            self.shared.ended_cached(&ended);
            for _ in 0..self.shared.options.workers {
                self.shared.wake.notify_one();
            }
        }
        self.shared.store.complete_batch(new.id).await?;
        tracing::info!(batch = %new.id, jobs = new.count, rejected = new.rejected, "batch queued");
        Ok(())
    }

    async fn drop_batch(&self, id: Uuid) -> Result<(), JobsError> {
        while !self.shared.store.drop_batch(id, DELETED_AT_ONCE).await? {}
        self.shared.collect_blobs().await;
        Ok(())
    }

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
        for (job, state) in self
            .shared
            .store
            .cancel_batch(id, self.shared.now_ms())
            .await?
        {
            if state.ended() {
                self.shared.metrics.ended(state, 1);
                self.shared.announce(job);
            } else if let Some(watch) = self.shared.running().get(&job) {
                watch.stop(Reason::Cancel);
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
                        && self.get(first).await.is_ok_and(|job| !job.state.ended())
                    {
                        let look = until.min(Instant::now() + LOOK_AGAIN);
                        tokio::select! {
                            _ = timeout_at(look, ended.recv()) => {}
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

    fn new_job(
        &self,
        card: Card,
        case: Vec<u8>,
        wishes: Wishes,
        traceparent: Option<Arc<str>>,
    ) -> NewJob {
        let id = Uuid::now_v7();
        NewJob {
            id,
            tenant: self.tenant.clone(),
            created_at: created_at(id),
            name: card.name,
            labels: card.labels,
            method: card.method,
            outputs: card.outputs,
            cost_us: card.cost_us,
            body: Bytes::from(case),
            reuse_key: self.reuse_key(&card.digest),
            source: None,
            idempotency: None,
            traceparent,
            wishes,
        }
    }

    fn spool_failed(&self, source: std::io::Error) -> JobsError {
        JobsError::DataDir {
            path: self.shared.options.data_dir.clone(),
            source,
        }
    }
}
