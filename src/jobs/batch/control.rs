//! Batches in the job table: filling, reading results, and removal of abandoned batches.
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use tokio::time::Instant;
use uuid::Uuid;

use crate::batch::upload::BatchUpload;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::{BatchItem, Kind, State, SubmitOptions, WorkOptions};
use crate::shared::Shared;
use crate::storage_fault::StoragePlace;
use crate::store::{BatchBegun, NewBatch, NewJob};
use crate::sync::{blocking, lock};
use crate::trace::{KeyValue, SubmitSpan};

/// Number of jobs removed in one transaction.
pub(crate) const DELETED_AT_ONCE: u32 = 500;

impl Shared {
    /// Abandons a batch: it is no longer filled, and its jobs are neither shown nor solved.
    pub(crate) fn abandon(&self, id: Uuid) {
        let mut batches = lock(&self.batches);
        batches.living.remove(&id);
        batches.abandoned.insert(id);
    }

    /// Removes the jobs of abandoned batches. Failed removals are repeated later.
    pub(crate) async fn drop_abandoned(&self) {
        let abandoned: Vec<Uuid> = lock(&self.batches).abandoned.iter().copied().collect();
        for id in abandoned {
            let dropped = self.drop_batch(id).await;
            self.observe_storage(StoragePlace::Table, &dropped);
            match dropped {
                Ok(()) => {
                    lock(&self.batches).abandoned.remove(&id);
                    tracing::info!(batch = %id, "batch that was never acknowledged removed");
                }
                Err(error) => {
                    tracing::warn!(batch = %id, %error, "batch that was never acknowledged cannot be removed yet");
                }
            }
        }
        self.collect_blobs().await;
    }

    async fn drop_batch(&self, id: Uuid) -> Result<()> {
        while !self.store.drop_batch(id, DELETED_AT_ONCE).await? {}
        Ok(())
    }
}

/// Number of jobs queued in one transaction.
const CHUNK_JOBS: usize = 1000;

/// Number of bytes of cases queued in one transaction; the last case may exceed it.
const CHUNK_BYTES: usize = 4 << 20;

/// Shortest and longest pause between two reads of a batch that another request fills.
const FILLING_PAUSE: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

impl Jobs {
    /// Queues the valid cases of a batch, or the chunks of a run. Once this returns, all of them are durable; if it fails, none of them is
    /// queued. Workers begin when all are queued. Returns the id of the batch, and whether it is that of an earlier
    /// submission with the same idempotency key.
    ///
    /// # Errors
    /// [`JobsError::QueueFull`], [`JobsError::QuotaExceeded`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`],
    /// or a failed database.
    pub async fn submit_batch(
        &self,
        draft: BatchUpload,
        mut options: WorkOptions,
    ) -> Result<(Uuid, bool)> {
        // Results of rows are not cached.
        options.submit.bypass_cache |= draft.new.kind == Kind::Rows;
        let span = SubmitSpan::begin(self.tracer());
        let jobs = draft.cases - draft.new.rejected;
        let submitted = self.store_batch(draft, options, span.traceparent());
        span.end(submitted.await, |(id, _)| {
            vec![
                KeyValue::new("railhead.batch.id", id.to_string()),
                KeyValue::new("railhead.batch.jobs", i64::from(jobs)),
            ]
        })
    }

    async fn store_batch(
        &self,
        mut draft: BatchUpload,
        options: WorkOptions,
        traceparent: Option<Arc<str>>,
    ) -> Result<(Uuid, bool)> {
        let submit = (options.submit, traceparent);
        let new = draft.as_new(options);
        // The batch is stored even if the client disconnects, so that none is left incomplete.
        let jobs = self.clone();
        let stored = self.shared.tasks.spawn(async move {
            let stored = jobs.begin_and_fill(&new, &mut draft, submit).await;
            if stored.is_err() {
                jobs.shared.abandon(new.id);
            }
            drop(draft);
            match &stored {
                Ok(_) => jobs.shared.wake_workers(),
                Err(_) => jobs.shared.drop_abandoned().await,
            }
            stored
        });
        let stored = stored.await;
        stored.map_err(|error| JobsError::Damaged(error.to_string()))?
    }

    /// Stores a batch, or finds that of its idempotency key; `true` in the second case.
    async fn begin_and_fill(
        &self,
        new: &NewBatch,
        draft: &mut BatchUpload,
        submit: (SubmitOptions, Option<Arc<str>>),
    ) -> Result<(Uuid, bool)> {
        let store = &self.shared.store;
        let filled_here = |id| lock(&self.shared.batches).living.contains(&id);
        let mut pause = FILLING_PAUSE.0;
        loop {
            if self.shared.draining.is_cancelled() {
                return Err(JobsError::Draining);
            }
            let begun = store.begin_batch(new, &filled_here, self.queue_bounds());
            match self.observe_write(begun.await)? {
                BatchBegun::Created => break,
                BatchBegun::Existing(id) => return Ok((id, true)),
                BatchBegun::Conflict => return Err(JobsError::IdempotencyConflict),
                BatchBegun::Refused(refusal) => return Err(self.refused(refusal)),
                BatchBegun::Unfinished => tokio::time::sleep(pause).await,
            }
            pause = (2 * pause).min(FILLING_PAUSE.1);
        }
        self.observe_write(self.fill(new, draft, submit).await)?;
        Ok((new.id, false))
    }

    async fn fill(
        &self,
        new: &NewBatch,
        draft: &mut BatchUpload,
        (options, traceparent): (SubmitOptions, Option<Arc<str>>),
    ) -> Result<()> {
        let Some(staging) = draft.staging.take() else {
            return Ok(());
        };
        let mut reader = staging
            .into_reader()
            .map_err(|source| self.spool_failed(source))?;
        loop {
            if self.shared.stopping.is_cancelled() {
                return Err(JobsError::Draining);
            }
            let taken = blocking(move || {
                let cases = reader.take(CHUNK_JOBS, CHUNK_BYTES);
                (reader, cases)
            });
            let (back, cases) = taken.await?;
            reader = back;
            let cases = cases.map_err(|source| self.spool_failed(source))?;
            if cases.is_empty() {
                break;
            }
            let some: Vec<(u32, NewJob)> = cases
                .into_iter()
                .map(|((index, own, staged), body)| {
                    let blank = self.blank_job();
                    let job = NewJob {
                        id: blank.id,
                        tenant: blank.tenant,
                        created_at: blank.created_at,
                        kind: new.kind.of_job(),
                        body: body.into(),
                        traceparent: traceparent.clone(),
                        options: options.of_case(own),
                        ..staged
                    };
                    (index, job)
                })
                .collect();
            let ended = self.shared.store.fill_batch(new.id, &some).await?;
            let stored = some.iter().map(|(_, job)| job);
            self.shared.ended_cached(stored, &ended);
        }
        self.shared.store.complete_batch(new.id).await?;
        tracing::info!(batch = %new.id, jobs = new.count, rejected = new.rejected, "batch queued");
        Ok(())
    }
}

/// Size of the small solutions that are read with one page.
pub const PAGE_BYTES: usize = 256 << 10;

/// Number of jobs of the first page.
const FIRST_PAGE_JOBS: u32 = 50;
/// Maximum number of jobs of a page.
const PAGE_JOBS: u32 = 500;

/// Pause between two reads while waiting for a job.
const REREAD_PAUSE: Duration = Duration::from_millis(10);

/// Size of a solution, and a stream of its text without the closing brace.
pub type OpenedItem = (usize, BoxStream<'static, Result<Bytes>>);

/// Iterates over the jobs of a batch or the chunks of a run, in the order of submission.
#[derive(Debug)]
pub struct Items {
    jobs: Jobs,
    batch: Uuid,
    page: u32,
    /// The last job that was read.
    pub after: Option<Uuid>,
    /// Time until which to wait for jobs that have not ended; `None`: no waiting.
    pub until: Option<Instant>,
    /// States of the returned jobs; empty: all states.
    pub states: Vec<State>,
    /// Jobs of the current page that were not returned yet.
    pub read: VecDeque<BatchItem>,
}

impl Items {
    /// Returns the next job; `None` at the end of the batch.
    ///
    /// # Errors
    /// A failed database.
    pub async fn next(&mut self) -> Result<Option<BatchItem>> {
        self.fill().await?;
        Ok(self.read.pop_front())
    }

    /// Reads the next page if the current one is consumed; `false` at the end of the batch. Small results are read with
    /// their jobs, at most [`PAGE_BYTES`] per page; large ones are read by [`Jobs::open_item`]. Before the time `until`,
    /// pages contain ended jobs only, and the first job is waited for.
    ///
    /// # Errors
    /// A failed database.
    pub async fn fill(&mut self) -> Result<bool> {
        let shared = &self.jobs.shared;
        while self.read.is_empty() {
            let items = shared.store.batch_items(
                &self.jobs.tenant,
                self.batch,
                self.after,
                self.page,
                PAGE_BYTES,
            );
            let mut items = items.await?;
            let now = Instant::now();
            let until = self.until.filter(|until| now < *until);
            if let Some(until) = until.filter(|_| !shared.draining.is_cancelled()) {
                let ended = items.iter().take_while(|item| item.job.state.ended());
                let ended = ended.count();
                if let Some(first) = items.first().filter(|_| ended == 0) {
                    // If it was removed, the page is read again.
                    let jobs = self.jobs.of_kind(Kind::Case);
                    let _ = jobs.wait_for(first.job.id, until - now).await;
                    // Many jobs may end at the same time; one read covers all of them.
                    tokio::time::sleep(REREAD_PAUSE).await;
                    continue;
                }
                items.truncate(ended);
            }
            let Some(last) = items.last() else {
                return Ok(false);
            };
            self.after = Some(last.job.id);
            self.page = match self.states.is_empty() {
                true => (2 * u32::try_from(items.len()).unwrap_or(PAGE_JOBS)).clamp(4, PAGE_JOBS),
                false => PAGE_JOBS,
            };
            items.retain(|item| self.states.is_empty() || self.states.contains(&item.job.state));
            self.read = items.into();
        }
        Ok(true)
    }
}

impl Jobs {
    /// Iterates over the jobs of a batch or the chunks of a run.
    #[must_use]
    pub fn items(&self, batch: Uuid) -> Items {
        Items {
            jobs: self.clone(),
            batch,
            page: FIRST_PAGE_JOBS,
            after: None,
            until: None,
            states: Vec::new(),
            read: VecDeque::new(),
        }
    }

    /// The keys of the labels of the jobs of a batch, sorted, at most `limit`.
    ///
    /// # Errors
    /// A failed database.
    pub async fn batch_label_keys(&self, id: Uuid, limit: u32) -> Result<Vec<String>> {
        let store = &self.shared.store;
        Ok(store.batch_label_keys(&self.tenant, id, limit).await?)
    }

    /// Opens the result of a job of a batch that is stored outside the table.
    ///
    /// # Errors
    /// [`JobsError::Expired`] if the job was removed in the meantime; or the result cannot be read.
    pub async fn open_item(&self, id: Uuid, key: &str) -> Result<OpenedItem> {
        let opened = self.shared.blobs.open_solution(key).await;
        self.unless_gone(id, opened).await
    }
}
