//! Batches in the making: cases are checked and staged while they arrive, on places reserved for them, and then queued.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use opentelemetry::KeyValue;
use serde_json::Value;
use tokio::runtime::Handle;
use uuid::Uuid;

use crate::contact::error::Fault;
use crate::jobs::batch::Batch;
use crate::jobs::error::JobsError;
use crate::jobs::spool::{Card, Spool};
use crate::jobs::store::{Begun, NewBatch, NewJob};
use crate::jobs::submit::{cost_us, created_at, outputs_text};
use crate::jobs::template::Cell;
use crate::jobs::wishes::Wishes;
use crate::jobs::{Jobs, idempotency};

/// Jobs queued in one transaction.
const CHUNK_JOBS: usize = 1000;
/// Bytes of cases queued in one transaction, the last case beyond them included.
const CHUNK_BYTES: usize = 4 << 20;
/// Faulty cases whose faults are kept; further ones are only counted.
const FAULTY_KEPT: usize = 1000;
/// Good cases of a batch that are staged before places are reserved: a batch that small is refused early enough when it
/// is queued.
const UNRESERVED_MAX: u32 = 1000;
/// Shortest and longest pause between two looks at a batch that another request is filling.
const FILLING_PAUSE: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

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

/// A batch in the making: checked cases wait in a file of the data folder. Dropping it gives everything back.
#[derive(Debug)]
pub struct Draft {
    jobs: Jobs,
    id: Uuid,
    spool: Option<Spool>,
    template: Option<Bytes>,
    digest: blake3::Hasher,
    /// Cases seen so far.
    pub cases: u32,
    /// Faulty ones among them.
    pub rejected: u32,
    /// The first faulty ones.
    pub faulty: Vec<FaultyCase>,
    /// What is wished for all jobs.
    pub wishes: Wishes,
    /// Places in the queue reserved so far.
    reserved: u32,
    /// Bytes counted so far.
    staged: u64,
    /// There may be something of it in the job table.
    in_table: bool,
}

impl Draft {
    /// The case that rows added with [`Draft::add_row`] fill.
    pub fn set_template(&mut self, template: Bytes) {
        self.digest.update(&template);
        self.template = Some(template);
    }

    /// Checks one more case and keeps it if it has no fault. `case` is what `text` says, or why it says nothing. Blocks;
    /// not to be called on a thread that answers requests.
    ///
    /// # Errors
    /// The file could not be written, or there is no room for more cases: [`JobsError::QueueFull`],
    /// [`JobsError::QuotaExceeded`], [`JobsError::StagingFull`], [`JobsError::StagingQuotaExceeded`].
    pub fn add(
        &mut self,
        line: Option<u64>,
        text: &[u8],
        case: Result<Value, String>,
    ) -> Result<(), JobsError> {
        self.count(text.len())?;
        self.check(line, text, case, None)
    }

    /// As [`Draft::add`], of a row of a table: the case that it makes of the template, with what it puts into it.
    ///
    /// # Errors
    /// As [`Draft::add`].
    pub fn add_row(
        &mut self,
        line: Option<u64>,
        text: &[u8],
        row: Result<(Value, Vec<Cell>), String>,
    ) -> Result<(), JobsError> {
        // Checked and solved as a case of this size, however little is kept of it.
        self.count(text.len() + self.template.as_ref().map_or(0, Bytes::len))?;
        let (case, cells) = match row {
            Ok((case, cells)) => (Ok(case), serde_json::to_vec(&cells)),
            Err(reason) => (Err(reason), Ok(Vec::new())),
        };
        let cells = cells.map_err(|error| JobsError::Damaged(error.to_string()))?;
        self.check(line, text, case, Some(cells))
    }

    fn check(
        &mut self,
        line: Option<u64>,
        text: &[u8],
        case: Result<Value, String>,
        row: Option<Vec<u8>>,
    ) -> Result<(), JobsError> {
        let index = self.cases;
        self.cases += 1;
        let checked = match &case {
            Ok(case) => {
                self.digest.update(&idempotency::digest(case));
                self.jobs.check(case).map_err(|error| error.0)
            }
            Err(reason) => {
                self.digest.update(text);
                Err(vec![Fault {
                    pointer: String::new(),
                    detail: reason.clone(),
                }])
            }
        };
        let problem = match checked {
            Ok(problem) => problem,
            Err(faults) => {
                self.rejected += 1;
                if self.faulty.len() < FAULTY_KEPT {
                    self.faulty.push(FaultyCase {
                        index,
                        line,
                        faults,
                    });
                }
                return Ok(());
            }
        };
        self.require_place()?;
        let card = Card {
            index,
            row: row.is_some(),
            method: problem.method.name().to_owned(),
            outputs: outputs_text(&problem.outputs),
            cost_us: cost_us(&problem),
            slice_us: self.jobs.slice_us(&problem),
            digest: problem.digest,
            name: problem.name,
            labels: problem.labels,
        };
        let Some(spool) = &mut self.spool else {
            return Ok(());
        };
        let written = spool.push(&card, row.as_deref().unwrap_or(text));
        written.map_err(|source| self.jobs.spool_failed(source))
    }

    fn count(&mut self, bytes: usize) -> Result<(), JobsError> {
        let (shared, bytes) = (&self.jobs.shared, bytes as u64);
        let bounds = shared.options.staging;
        shared.staged.add(&self.jobs.tenant, bytes, bounds)?;
        self.staged += bytes;
        Ok(())
    }

    /// Reserves more places as the batch grows, twice as many each time, so that few writes reserve many.
    fn require_place(&mut self) -> Result<(), JobsError> {
        let good = self.cases - self.rejected;
        if good <= UNRESERVED_MAX || good <= self.reserved {
            return Ok(());
        }
        let most = self.reserved.max(2 * UNRESERVED_MAX);
        self.in_table = true;
        let store = &self.jobs.shared.store;
        let bounds = self.jobs.queue_bounds();
        let reserved =
            Handle::current().block_on(store.reserve(self.id, &self.jobs.tenant, most, bounds));
        self.reserved += match self.jobs.noted(reserved)? {
            Ok(places) => places,
            Err(refusal) => return Err(self.jobs.refused(refusal)),
        };
        if good > self.reserved {
            // The first reservation has to cover what was staged without one.
            return self.require_place();
        }
        Ok(())
    }

    /// Nothing of it is left to be given back but its bytes.
    fn settle(&mut self) {
        self.in_table = false;
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        let shared = &self.jobs.shared;
        shared.staged.give_back(&self.jobs.tenant, self.staged);
        if self.in_table {
            shared.abandon(self.id);
            if let Ok(runtime) = Handle::try_current() {
                let shared = shared.clone();
                let tasks = shared.tasks.clone();
                tasks.spawn_on(async move { shared.drop_abandoned().await }, &runtime);
            }
        } else {
            shared.underway().forget(self.id);
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
        let spool = spool.map_err(|source| self.spool_failed(source))?;
        let id = Uuid::now_v7();
        self.shared.underway().living.insert(id);
        Ok(Draft {
            jobs: self.clone(),
            id,
            spool: Some(spool),
            template: None,
            digest: blake3::Hasher::new(),
            cases: 0,
            rejected: 0,
            faulty: Vec::new(),
            wishes: Wishes::default(),
            reserved: 0,
            staged: 0,
            in_table: false,
        })
    }

    /// Queues the good cases of a draft. Once this returns all of them survive the death of the process; if it fails,
    /// none of them will be there. Workers begin once all are there. Also says whether the batch is that of an
    /// earlier submission with the same idempotency key.
    ///
    /// # Errors
    /// [`JobsError::QueueFull`], [`JobsError::QuotaExceeded`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`],
    /// or a failed database.
    pub async fn submit_batch(
        &self,
        draft: Draft,
        idempotency_key: Option<String>,
    ) -> Result<(Batch, bool), JobsError> {
        let span = self.submitting();
        let traceparent = span.traceparent();
        let submitted = self.store_batch(draft, idempotency_key, traceparent);
        span.end(submitted.await, |(batch, _)| {
            vec![
                KeyValue::new("railhead.batch.id", batch.id.to_string()),
                KeyValue::new("railhead.batch.jobs", i64::from(batch.count)),
            ]
        })
    }

    async fn store_batch(
        &self,
        mut draft: Draft,
        idempotency_key: Option<String>,
        traceparent: Option<Arc<str>>,
    ) -> Result<(Batch, bool), JobsError> {
        let id = draft.id;
        let digest = draft.wishes.digest(draft.digest.finalize().as_bytes());
        let new = NewBatch {
            id,
            tenant: self.tenant.clone(),
            created_at: created_at(id),
            count: draft.cases - draft.rejected,
            rejected: draft.rejected,
            template: draft.template.clone(),
            idempotency: idempotency_key.map(|key| (key, digest)),
        };
        let mut pause = FILLING_PAUSE.0;
        loop {
            if self.shared.draining.is_cancelled() {
                return Err(JobsError::Draining);
            }
            let living = self.shared.underway().living.clone();
            let known = self.shared.store.batch_by_key(&new, &living).await?;
            let begun = match known {
                Some(begun) => begun,
                None => {
                    draft.in_table = true;
                    self.shared.underway().filling.insert(id);
                    let bounds = self.queue_bounds();
                    let begun = self.shared.store.begin_batch(&new, &living, bounds).await;
                    self.noted(begun)?
                }
            };
            match begun {
                Begun::Created => break,
                Begun::Existing(id) => return Ok((self.batch(id).await?, true)),
                Begun::Conflict => return Err(JobsError::IdempotencyConflict),
                Begun::Refused(refusal) => {
                    self.give_up(draft).await;
                    return Err(self.refused(refusal));
                }
                Begun::Unfinished => tokio::time::sleep(pause).await,
            }
            pause = (2 * pause).min(FILLING_PAUSE.1);
        }
        // A client that hangs up must not leave a batch half filled, so the filling goes on without it.
        let jobs = self.clone();
        let filled = self.shared.tasks.spawn(async move {
            let filled = jobs.fill(&new, &mut draft, traceparent).await;
            match &filled {
                Ok(()) => {
                    draft.settle();
                    // Opens the batch to the workers.
                    drop(draft);
                    for _ in 0..jobs.shared.options.workers {
                        jobs.shared.wake.notify_one();
                    }
                }
                Err(_) => jobs.give_up(draft).await,
            }
            filled
        });
        let filled = filled
            .await
            .map_err(|error| JobsError::Damaged(error.to_string()))?;
        self.noted(filled)?;
        Ok((self.batch(id).await?, false))
    }

    async fn fill(
        &self,
        new: &NewBatch,
        draft: &mut Draft,
        traceparent: Option<Arc<str>>,
    ) -> Result<(), JobsError> {
        let wishes = draft.wishes;
        let Some(spool) = draft.spool.take() else {
            return Ok(());
        };
        let mut reader = spool
            .into_reader()
            .map_err(|source| self.spool_failed(source))?;
        loop {
            if self.shared.stopping.is_cancelled() {
                return Err(JobsError::Draining);
            }
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
        }
        self.shared.store.complete_batch(new.id).await?;
        tracing::info!(batch = %new.id, jobs = new.count, rejected = new.rejected, "batch queued");
        Ok(())
    }

    /// Ends a draft that is not wanted any more, at once if the disk allows it.
    async fn give_up(&self, mut draft: Draft) {
        if draft.in_table {
            self.shared.abandon(draft.id);
            draft.settle();
            self.shared.drop_abandoned().await;
        }
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
            slice_us: card.slice_us,
            body: Bytes::from(case),
            row: card.row,
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
