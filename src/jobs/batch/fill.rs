//! Queues the cases of an uploaded batch.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;

use crate::jobs::batch::staging::StagedCase;
use crate::jobs::batch::upload::BatchUpload;
use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::submit_options::SubmitOptions;
use crate::jobs::store::submission::{BatchBegun, NewBatch, NewJob};
use crate::jobs::sync::blocking;
use crate::jobs::trace::KeyValue;

/// Jobs queued in one transaction.
const CHUNK_JOBS: usize = 1000;

/// Bytes of cases queued in one transaction, the last case beyond them included.
const CHUNK_BYTES: usize = 4 << 20;

/// Shortest and longest pause between two reads of a batch that another request is filling.
const FILLING_PAUSE: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));

impl Jobs {
    /// Queues the good cases of an upload. Once this returns all of them survive the death of the process; if it fails,
    /// none of them will be there. Workers begin once all are there. Also says whether the batch is that of an
    /// earlier submission with the same idempotency key.
    ///
    /// # Errors
    /// [`JobsError::QueueFull`], [`JobsError::QuotaExceeded`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`],
    /// or a failed database.
    pub async fn submit_batch(
        &self,
        draft: BatchUpload,
        idempotency_key: Option<String>,
    ) -> Result<(Batch, bool), JobsError> {
        let span = self.submit_span();
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
        mut draft: BatchUpload,
        idempotency_key: Option<String>,
        traceparent: Option<Arc<str>>,
    ) -> Result<(Batch, bool), JobsError> {
        let (kind, id) = (draft.kind, draft.id);
        let new = draft.as_new(idempotency_key);
        let filled_here = |id| self.shared.unfinished_batches().living.contains(&id);
        let mut pause = FILLING_PAUSE.0;
        loop {
            if self.shared.draining.is_cancelled() {
                return Err(JobsError::Draining);
            }
            let known = self.shared.store.batch_by_key(&new, &filled_here).await?;
            let begun = match known {
                Some(begun) => begun,
                None => {
                    draft.in_table = true;
                    let bounds = self.queue_bounds();
                    let store = &self.shared.store;
                    let begun = store.begin_batch(&new, &filled_here, bounds).await;
                    self.observe_write(begun)?
                }
            };
            match begun {
                BatchBegun::Created => break,
                BatchBegun::Existing(id) => return Ok((self.batch(new.kind, id).await?, true)),
                BatchBegun::Conflict => return Err(JobsError::IdempotencyConflict),
                BatchBegun::Refused(refusal) => {
                    self.give_up(draft).await;
                    return Err(self.refused(refusal));
                }
                BatchBegun::Unfinished => tokio::time::sleep(pause).await,
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
                    jobs.shared.wake_workers();
                }
                Err(_) => jobs.give_up(draft).await,
            }
            filled
        });
        let filled = filled
            .await
            .map_err(|error| JobsError::Damaged(error.to_string()))?;
        self.observe_write(filled)?;
        Ok((self.batch(kind, id).await?, false))
    }

    async fn fill(
        &self,
        new: &NewBatch,
        draft: &mut BatchUpload,
        traceparent: Option<Arc<str>>,
    ) -> Result<(), JobsError> {
        let options = draft.options;
        let Some(staging) = draft.staging.take() else {
            return Ok(());
        };
        let mut reader = staging
            .into_reader()
            .map_err(|source| self.staging_failed(source))?;
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
            let cases = cases.map_err(|source| self.staging_failed(source))?;
            if cases.is_empty() {
                break;
            }
            let mut some: Vec<_> = cases
                .into_iter()
                .map(|(staged, case)| {
                    let traceparent = traceparent.clone();
                    (
                        staged.index,
                        NewJob {
                            kind: new.kind.of_job(),
                            ..self.staged_job(staged, case, options, traceparent)
                        },
                    )
                })
                .collect();
            if !options.bypass_cache {
                self.find_sources(some.iter_mut().map(|(_, job)| job))
                    .await?;
            }
            let ended = self.shared.store.fill_batch(new.id, &some).await?;
            self.shared.ended_cached(&ended);
        }
        self.shared.store.complete_batch(new.id).await?;
        tracing::info!(batch = %new.id, jobs = new.count, rejected = new.rejected, "batch queued");
        Ok(())
    }

    /// Removes what is left of a failed upload, at once if the disk allows it.
    async fn give_up(&self, mut draft: BatchUpload) {
        if draft.in_table {
            self.shared.abandon(draft.id);
            draft.settle();
            self.shared.drop_abandoned().await;
        }
    }

    fn staged_job(
        &self,
        staged: StagedCase,
        case: Vec<u8>,
        options: SubmitOptions,
        traceparent: Option<Arc<str>>,
    ) -> NewJob {
        NewJob {
            name: staged.name,
            labels: staged.labels,
            method: staged.method,
            outputs: staged.outputs,
            cost_us: staged.cost_us,
            slice_us: staged.slice_us,
            body: Bytes::from(case),
            row: staged.row,
            // A chunk of rows has none.
            cache_key: Some(staged.digest)
                .filter(|digest| !digest.is_empty())
                .and_then(|digest| self.cache_key(&digest)),
            traceparent,
            options: options.of_case(staged.own),
            ..self.blank_job()
        }
    }
}
