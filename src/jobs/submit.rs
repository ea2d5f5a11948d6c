//! Submission of single jobs: check, idempotency key, result cache, queue.

use std::sync::Arc;

use bytes::Bytes;
use serde_json::{Value, json};
use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::idempotency;
use crate::model::{Job, Kind, State, WorkOptions, created_at};
use crate::shared::Shared;
use crate::store::{CacheKey, Enqueued, NewJob, QueueBounds, Refusal};
use crate::sync::blocking;
use crate::trace::{KeyValue, SubmitSpan};
use railhead_contact::case::words::solver::Output;
use railhead_contact::error::CaseError;
use railhead_contact::evaluate::varied::in_template;
use railhead_contact::evolution::task::Evolution;
use railhead_contact::problem::checked_case::CheckedCase;

impl Jobs {
    /// Checks a case and queues it. The job is durable once this returns. If an identical case was solved before, the job
    /// has already succeeded with its result.
    ///
    /// With an idempotency key the same case returns the same job for as long as that job exists.
    ///
    /// # Errors
    /// [`JobsError::Case`], [`JobsError::QueueFull`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`], or a
    /// failed database.
    pub async fn submit(&self, case: Value, idempotency_key: Option<String>) -> Result<Job> {
        let options = WorkOptions {
            idempotency_key,
            ..WorkOptions::default()
        };
        let submitted = self.submit_with(case, options);
        submitted.await.map(|(job, _)| job)
    }

    /// As [`Jobs::submit`], with options; also returns whether the job is that of an earlier submission with the same
    /// idempotency key.
    ///
    /// # Errors
    /// As [`Jobs::submit`].
    pub async fn submit_with(&self, case: Value, options: WorkOptions) -> Result<(Job, bool)> {
        let check = |jobs: &Jobs, case: &Value| {
            let mut checked = jobs.check(case)?;
            jobs.bind(&mut checked.label.labels).map_err(CaseError)?;
            Ok(jobs.new_job(checked))
        };
        let case = self.with_profiles(case).await?;
        let small = is_small(&case);
        self.submit_work(case, small, check, options).await
    }

    /// Checks an evolution and queues it. JSON pointers in its columns refer to its template.
    ///
    /// # Errors
    /// As [`Jobs::submit`].
    pub async fn submit_evolution(
        &self,
        mut request: Value,
        mut options: WorkOptions,
    ) -> Result<(Job, bool)> {
        let name = options.name.take();
        let labels = std::mem::take(&mut options.labels);
        if let Some(template) = request.get_mut("template") {
            let filled = self.with_profiles(template.take()).await;
            *template = filled.map_err(|error| match error {
                JobsError::Case(faults) => in_template(faults, |_| None).into(),
                error => error,
            })?;
        }
        self.fill_events(&mut request).await?;
        let check = move |jobs: &Jobs, request: &Value| {
            let task = Evolution::check(request, &jobs.shared.options.limits)?;
            let seconds = task.expected_seconds();
            Ok(NewJob {
                kind: Kind::Evolution,
                method: Kind::Evolution.name().to_owned(),
                outputs: outputs_text(&[]),
                cost_us: microseconds(seconds),
                slice_us: microseconds(seconds / f64::from(task.plan.records)),
                name,
                labels,
                ..jobs.blank_job()
            })
        };
        self.submit_work(request, false, check, options).await
    }

    /// Resolves the references to stored profiles in the events of an evolution.
    async fn fill_events(&self, request: &mut Value) -> Result<()> {
        let events = request.get("events").and_then(Value::as_array);
        let places = (0..events.map_or(0, Vec::len))
            .flat_map(|event| ["grind", "reprofile"].map(|kind| format!("/events/{event}/{kind}")));
        for place in places {
            let Some(section) = request.pointer_mut(&place) else {
                continue;
            };
            // A case with this section has the same references and faults.
            let case = json!({ "contact": { "rail": section.take() } });
            let mut filled = self
                .with_profiles(case)
                .await
                .map_err(|error| match error {
                    JobsError::Case(CaseError(mut faults)) => {
                        for fault in &mut faults {
                            fault.pointer = fault.pointer.replacen("/contact/rail", &place, 1);
                        }
                        CaseError(faults).into()
                    }
                    error => error,
                })?;
            *section = filled["contact"]["rail"].take();
        }
        Ok(())
    }

    /// Checks work and queues it.
    async fn submit_work(
        &self,
        request: Value,
        small: bool,
        check: impl FnOnce(&Jobs, &Value) -> Result<NewJob> + Send + 'static,
        options: WorkOptions,
    ) -> Result<(Job, bool)> {
        let span = SubmitSpan::begin(self.tracer());
        let traceparent = span.traceparent();
        let submitted = self.store_work(request, small, check, (options, traceparent));
        span.end(submitted.await, |(job, _)| {
            vec![
                KeyValue::new("railhead.job.id", job.id.to_string()),
                KeyValue::new("railhead.job.cached", job.cached),
            ]
        })
    }

    async fn store_work(
        &self,
        request: Value,
        small: bool,
        check: impl FnOnce(&Jobs, &Value) -> Result<NewJob> + Send + 'static,
        (options, traceparent): (WorkOptions, Option<Arc<str>>),
    ) -> Result<(Job, bool)> {
        let (key, options) = (options.idempotency_key, options.submit);
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        let jobs = self.clone();
        let read = move || {
            let digest = || jobs.bound_digest(options.digest(&idempotency::digest(&request)));
            let idempotency = key.map(|key| (key, digest()));
            (
                check(&jobs, &request),
                serde_json::to_vec(&request),
                idempotency,
            )
        };
        let (checked, body, idempotency) = if small {
            read()
        } else {
            // Checking a large case takes CPU time: it runs outside the request threads, with limited concurrency.
            let _turn = self.shared.checks.acquire().await;
            blocking(read).await?
        };
        if let Some((key, digest)) = &idempotency
            && let Some(enqueued) = self
                .shared
                .store
                .job_by_key(&self.tenant, key, digest)
                .await?
        {
            match self.of_enqueued(enqueued) {
                // The job has expired and is about to be removed, so the key is free.
                Err(JobsError::Expired) => self.shared.store.forget_key(&self.tenant, key).await?,
                answer => return answer,
            }
        }
        let new = NewJob {
            idempotency,
            traceparent,
            options,
            body: Bytes::from(body.map_err(|error| JobsError::Damaged(error.to_string()))?),
            ..checked?
        };
        let stored = self.shared.store.enqueue(&new, self.queue_bounds()).await;
        let (job, replayed) = self.of_enqueued(self.observe_write(stored)?)?;
        if !replayed {
            let ended = job.cached.then_some(job.id);
            self.shared
                .ended_cached(std::iter::once(&new), ended.as_slice());
        }
        if replayed || !job.cached {
            self.shared.wake_worker();
        }
        tracing::info!(job = %job.id, method = new.method, cached = job.cached, "job stored");
        Ok((job, replayed))
    }

    /// A new job for a checked case.
    pub(crate) fn new_job(&self, checked: CheckedCase) -> NewJob {
        NewJob {
            method: checked.run.method.name().to_owned(),
            outputs: outputs_text(&checked.run.outputs),
            cost_us: microseconds(checked.cost().seconds),
            slice_us: self.slice_us(&checked),
            cache_key: self.cache_key(&checked.label.digest),
            name: checked.label.name,
            labels: checked.label.labels,
            ..self.blank_job()
        }
    }

    /// A new job without content.
    pub(crate) fn blank_job(&self) -> NewJob {
        let id = self.shared.new_id();
        NewJob {
            id,
            tenant: self.tenant.clone(),
            created_at: created_at(id),
            ..NewJob::default()
        }
    }

    /// Expected solve time of the longest slice of a case in µs.
    pub(crate) fn slice_us(&self, checked: &CheckedCase) -> u32 {
        let slices = (self.shared.engine.slices)(checked);
        let longest = slices.iter().map(ExactSizeIterator::len).max().unwrap_or(1);
        let part = longest as f64 / checked.problem.motions.len().max(1) as f64;
        microseconds(checked.cost().seconds * part)
    }

    /// The bounds of the queue.
    pub(crate) fn queue_bounds(&self) -> QueueBounds {
        QueueBounds {
            all: self.shared.options.queue_max,
            tenant: self.shared.options.tenant_queue_max,
            stored: self.shared.options.tenant_stored_max_bytes,
        }
    }

    /// The error for a refused submission.
    pub(crate) fn refused(&self, refusal: Refusal) -> JobsError {
        let bounds = self.queue_bounds();
        match refusal {
            Refusal::Quota => JobsError::QuotaExceeded(bounds.tenant),
            Refusal::Queue => JobsError::QueueFull(bounds.all),
            Refusal::Stored => JobsError::StoredQuotaExceeded(bounds.stored.unwrap_or(u64::MAX)),
        }
    }

    /// The created job, or the existing one of the idempotency key; `true` in the second case.
    fn of_enqueued(&self, enqueued: Enqueued) -> Result<(Job, bool)> {
        match enqueued {
            Enqueued::Created(job) => Ok((self.dated(job), false)),
            Enqueued::Existing(job) => Ok((self.unexpired(job)?, true)),
            Enqueued::Conflict => Err(JobsError::IdempotencyConflict),
            Enqueued::Refused(refusal) => Err(self.refused(refusal)),
        }
    }
}

// A case gets the stored result of an earlier identical case of the same tenant.
impl Jobs {
    /// The cache key of a case with this digest; `None` if the cache is disabled.
    pub(crate) fn cache_key(&self, digest: &str) -> Option<CacheKey> {
        if !self.shared.options.cache {
            return None;
        }
        let mut hasher = blake3::Hasher::new();
        // A tenant must not learn from a fast response that another one has solved the case.
        hasher.update(self.tenant.as_bytes());
        hasher.update(&[0]);
        hasher.update(digest.as_bytes());
        let mut key = CacheKey::default();
        hasher.finalize_xof().fill(&mut key);
        Some(key)
    }
}

impl Shared {
    /// Counts and announces the jobs that ended when they were stored, because their results were in the cache.
    pub(crate) fn ended_cached<'a>(
        &self,
        stored: impl Iterator<Item = &'a NewJob>,
        ended: &[Uuid],
    ) {
        let (lookups, hits) = (stored.filter_map(NewJob::lookup_key).count(), ended.len());
        let misses = lookups.saturating_sub(hits) as u64;
        self.metrics.cache_lookup(hits as u64, misses);
        self.metrics.ended(State::Succeeded, hits as u64);
        for id in ended {
            self.announce(*id);
        }
    }
}

/// Whether a case is so small that its check takes microseconds.
fn is_small(case: &Value) -> bool {
    const VALUES_MAX: usize = 100;
    const BYTES_PER_VALUE: usize = 16;
    fn count(value: &Value, most: usize) -> usize {
        let members: Box<dyn Iterator<Item = &Value>> = match value {
            Value::Array(values) => Box::new(values.iter()),
            Value::Object(members) => Box::new(members.values()),
            Value::String(text) => return 1 + text.len() / BYTES_PER_VALUE,
            _ => return 1,
        };
        let mut counted = 1;
        for member in members {
            if counted > most {
                break;
            }
            counted += count(member, most);
        }
        counted
    }
    count(case, VALUES_MAX) <= VALUES_MAX
}

/// The names of outputs as a JSON list.
pub(crate) fn outputs_text(outputs: &[Output]) -> String {
    serde_json::to_string(outputs).unwrap_or_default()
}

/// Converts a time in s to µs, at least 1.
pub(crate) fn microseconds(seconds: f64) -> u32 {
    let microseconds = (seconds * 1e6).clamp(1.0, f64::from(i32::MAX));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to what a u32 holds; a NaN becomes 0"
    )]
    {
        microseconds as u32
    }
}
