//! Who solves what, when, and what became of it? [`Jobs`] is all that the outside may call.
//!
//! A job is a row of the job table ([`store`]); its case hangs on the row, its result lies outside the table
//! ([`results`], [`fields`]). Workers ([`worker`]) claim the oldest queued job under a lease, solve it on a thread of
//! their own and finish it; a claim's lease number fences every later write. [`lifecycle`] opens, starts
//! and stops all this. A process that dies leaves `running` rows,
//! which go back to the queue when the data folder is opened again.

pub mod backup;
pub mod batch;
pub mod clock;
pub mod draft;
pub mod error;
pub mod fetch;
pub mod fields;
mod follow;
mod group;
mod housekeeping;
mod idempotency;
pub mod job;
pub mod keys;
pub mod lifecycle;
mod metrics;
pub mod recipe;
pub mod results;
pub mod retention;
mod reuse;
mod solver_thread;
mod spool;
pub mod staging;
mod storage;
pub mod store;
pub mod template;
pub mod trace;
pub mod watch;
pub mod wishes;
pub mod worker;

use std::collections::HashMap;
use std::fs::File;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use opentelemetry::KeyValue;
use serde_json::Value;
use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio::time::{Instant, timeout, timeout_at};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::Uuid;

use crate::contact::case::Output;
use crate::contact::error::CaseError;
use crate::contact::problem::Problem;
use crate::jobs::draft::Underway;
pub use crate::jobs::error::JobsError;
pub use crate::jobs::job::{Failure, FailureKind, Job, State};
use crate::jobs::keys::Trusted;
pub use crate::jobs::lifecycle::Options;
use crate::jobs::metrics::Metrics;
use crate::jobs::recipe::Recipe;
use crate::jobs::results::Results;
use crate::jobs::staging::Staged;
pub use crate::jobs::storage::Trouble;
pub use crate::jobs::store::list::{Filter, Page};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::{Deleted, Enqueued, NewJob, QueueBounds, Refusal};
use crate::jobs::watch::{Reason, Watch};
use crate::jobs::wishes::Wishes;

/// Longest list page.
pub const PAGE_MAX: u32 = 1000;
/// How often a waiting caller looks again although nothing was announced.
const LOOK_AGAIN: Duration = Duration::from_secs(1);
/// How long a readiness check waits for the database.
const READY_WITHIN: Duration = Duration::from_secs(2);
/// Jobs: submit, look, list, wait, cancel, fetch. A cheap handle; clones share everything.
#[derive(Debug, Clone)]
pub struct Jobs {
    shared: Arc<Shared>,
    /// Whose jobs this handle makes and sees.
    tenant: Arc<str>,
}

/// What every handle and every worker shares.
#[derive(Debug)]
struct Shared {
    options: Options,
    recipe: Recipe,
    store: SqliteStore,
    results: Results,
    /// Wakes an idle worker; a hint only, workers also look by themselves.
    wake: Notify,
    /// Announces ended jobs; a hint only, waiting callers also look by themselves.
    ended: broadcast::Sender<Uuid>,
    /// The attempts of this process.
    running: Mutex<HashMap<Uuid, Arc<Watch>>>,
    /// Set when the service is about to stop: no new claims, not ready, no more waiting.
    draining: CancellationToken,
    /// Set when the grace period is over: running jobs are handed back.
    stopping: CancellationToken,
    tasks: TaskTracker,
    metrics: Metrics,
    /// The last write failed because of the disk.
    storage_failing: AtomicBool,
    /// Keys found good a moment ago.
    trusted: Mutex<Trusted>,
    /// Cases of single jobs that may be checked at the same time.
    checks: Semaphore,
    /// Bytes of batches that are being received.
    staged: Staged,
    /// Batches that are being received or filled, and those of which only remains are left.
    batches: Mutex<Underway>,
    /// What a dead process left is taken back; nothing is claimed before.
    recovered: SetOnce<()>,
    /// Held as long as this process uses the data folder.
    lock: Mutex<Option<File>>,
}

impl Jobs {
    /// Checks a case against the limits of this service.
    ///
    /// # Errors
    /// Every fault of the case.
    pub fn check(&self, case: &Value) -> Result<Problem, CaseError> {
        (self.shared.recipe.check)(case, &self.shared.options.limits)
    }

    /// Checks a case and queues it. Once this returns the job survives the death of the process. If an identical case
    /// was solved before, the job has already succeeded, with that result.
    ///
    /// With an idempotency key the same case gives the same job again, however often it is submitted, for as long as
    /// that job exists.
    ///
    /// # Errors
    /// [`JobsError::Case`], [`JobsError::QueueFull`], [`JobsError::IdempotencyConflict`], [`JobsError::Draining`], or a
    /// failed database.
    pub async fn submit(
        &self,
        case: Value,
        idempotency_key: Option<String>,
    ) -> Result<Job, JobsError> {
        let submitted = self.submit_with(case, idempotency_key, Wishes::default());
        submitted.await.map(|(job, _)| job)
    }

    /// As [`Jobs::submit`], with wishes; also says whether the job is that of an earlier submission with the same
    /// idempotency key.
    ///
    /// # Errors
    /// As [`Jobs::submit`].
    pub async fn submit_with(
        &self,
        case: Value,
        idempotency_key: Option<String>,
        wishes: Wishes,
    ) -> Result<(Job, bool), JobsError> {
        let span = self.submitting();
        let traceparent = span.traceparent();
        let submitted = self.store_case(case, idempotency_key, wishes, traceparent);
        span.end(submitted.await, |(job, _)| {
            vec![
                KeyValue::new("railhead.job.id", job.id.to_string()),
                KeyValue::new("railhead.job.cached", job.cached),
            ]
        })
    }

    async fn store_case(
        &self,
        case: Value,
        idempotency_key: Option<String>,
        wishes: Wishes,
        traceparent: Option<Arc<str>>,
    ) -> Result<(Job, bool), JobsError> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        let jobs = self.clone();
        // Checking a large case is arithmetic; it stays off the threads that answer requests, and a crowd of submitters does
        // not take the cores from them either.
        let turn = self.shared.checks.acquire().await;
        let read = tokio::task::spawn_blocking(move || {
            let digest = |_: &String| wishes.digest(&idempotency::digest(&case));
            let idempotency = idempotency_key.map(|key| {
                let digest = digest(&key);
                (key, digest)
            });
            (jobs.check(&case), serde_json::to_vec(&case), idempotency)
        });
        let (problem, body, idempotency) = read
            .await
            .map_err(|error| JobsError::Damaged(error.to_string()))?;
        drop(turn);
        if let Some((key, digest)) = &idempotency
            && let Some(enqueued) = self.shared.store.by_key(&self.tenant, key, digest).await?
        {
            match self.of_enqueued(enqueued) {
                // The job is over and only waits for its removal: the key is free.
                Err(JobsError::Expired) => self.shared.store.forget_key(&self.tenant, key).await?,
                answer => return answer,
            }
        }
        let problem = problem?;
        let (outputs, cost_us) = (problem.outputs.clone(), cost_us(&problem));
        let id = Uuid::now_v7();
        let mut new = NewJob {
            id,
            tenant: self.tenant.clone(),
            created_at: created_at(id),
            name: problem.name,
            labels: problem.labels,
            method: problem.method.name().to_owned(),
            outputs: outputs_text(&outputs),
            cost_us,
            reuse_key: self.reuse_key(&problem.digest),
            source: None,
            body: Bytes::from(body.map_err(|error| JobsError::Damaged(error.to_string()))?),
            row: false,
            idempotency,
            traceparent,
            wishes,
        };
        if !wishes.fresh {
            self.find_sources(std::iter::once(&mut new)).await?;
        }
        let stored = self.shared.store.enqueue(&new, self.queue_bounds()).await;
        let (job, replayed) = self.of_enqueued(self.noted(stored)?)?;
        if job.id == id && job.cached {
            self.shared.ended_cached(&[id]);
            tracing::info!(job = %id, method = new.method, "job answered from an earlier result");
            return Ok((job, false));
        }
        self.shared.wake.notify_one();
        tracing::info!(job = %job.id, method = new.method, "job queued");
        Ok((job, replayed))
    }

    /// The bounds of the queue.
    fn queue_bounds(&self) -> QueueBounds {
        QueueBounds {
            all: self.shared.options.queue_max,
            tenant: self.shared.options.tenant_queue_max,
        }
    }

    /// Why there is no room.
    fn refused(&self, refusal: Refusal) -> JobsError {
        let bounds = self.queue_bounds();
        match refusal {
            Refusal::Quota => JobsError::QuotaExceeded {
                queue_max: bounds.tenant,
            },
            Refusal::Queue => JobsError::QueueFull {
                queue_max: bounds.all,
            },
        }
    }

    /// The job that was made, or that the idempotency key stands for, and whether it is the latter.
    fn of_enqueued(&self, enqueued: Enqueued) -> Result<(Job, bool), JobsError> {
        match enqueued {
            Enqueued::Created(job) => Ok((self.dated(job), false)),
            Enqueued::Existing(job) => Ok((self.unexpired(job)?, true)),
            Enqueued::Conflict => Err(JobsError::IdempotencyConflict),
            Enqueued::Refused(refusal) => Err(self.refused(refusal)),
        }
    }

    /// Looks at a job.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn get(&self, id: Uuid) -> Result<Job, JobsError> {
        let job = self.shared.store.get(id).await?;
        // What belongs to another tenant is answered like what does not exist.
        match job.filter(|job| *job.tenant == *self.tenant) {
            Some(job) => self.unexpired(job),
            None => Err(self.missing(id, JobsError::NotFound).await),
        }
    }

    /// Waits until a job has ended, but not longer than `at_most`, and returns it as it then is. Returns at once when
    /// the service is about to stop.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn wait(&self, id: Uuid, at_most: Duration) -> Result<Job, JobsError> {
        let until = Instant::now() + at_most;
        // Subscribe first, then look: what ends in between is announced.
        let mut ended = self.shared.ended.subscribe();
        loop {
            let job = self.get(id).await?;
            if job.state.ended() || Instant::now() >= until || self.shared.draining.is_cancelled() {
                return Ok(job);
            }
            let announced = async {
                // A lagging receiver may have missed the announcement, so it looks again as well.
                while ended.recv().await.is_ok_and(|ended| ended != id) {}
            };
            tokio::select! {
                _ = timeout_at(until.min(Instant::now() + LOOK_AGAIN), announced) => {}
                () = self.shared.draining.cancelled() => {}
            }
        }
    }

    /// One page of a list, newest first; `limit` is brought into 1 to [`PAGE_MAX`].
    ///
    /// # Errors
    /// [`JobsError::BadCursor`], or a failed database.
    pub async fn list(
        &self,
        filter: &Filter,
        cursor: Option<&str>,
        limit: u32,
    ) -> Result<Page, JobsError> {
        let store = &self.shared.store;
        let mut page = store
            .list(&self.tenant, filter, cursor, limit.clamp(1, PAGE_MAX))
            .await?;
        let jobs = page.jobs.into_iter();
        page.jobs = jobs.filter_map(|job| self.unexpired(job).ok()).collect();
        Ok(page)
    }

    /// Cancels a job: a queued one ends at once, a running one at the next tick of its solver, an ended one stays as
    /// it is. Returns the job as it then is.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn cancel(&self, id: Uuid) -> Result<Job, JobsError> {
        self.get(id).await?;
        let now = self.shared.now_ms();
        let job = self
            .shared
            .store
            .cancel(id, now)
            .await?
            .ok_or(JobsError::NotFound)?;
        if job.state.ended() {
            if job.state == State::Cancelled && job.ended_at == Some(now) {
                self.shared.metrics.ended(State::Cancelled, 1);
            }
            self.shared.announce(id);
        } else if let Some(watch) = self.shared.running().get(&id) {
            // A worker that registers later reads the wish from the table.
            watch.stop(Reason::Cancel);
        }
        Ok(self.dated(job))
    }

    /// Removes an ended job with its case and results.
    ///
    /// # Errors
    /// [`JobsError::NotEnded`], [`JobsError::NotFound`], or a failed database.
    pub async fn delete(&self, id: Uuid) -> Result<(), JobsError> {
        self.get(id).await?;
        match self.shared.store.delete(id).await? {
            Deleted::NotEnded(state) => Err(JobsError::NotEnded(state)),
            Deleted::NotFound => Err(JobsError::NotFound),
            Deleted::Done => {
                self.shared.collect_blobs().await;
                Ok(())
            }
        }
    }

    /// Can this service take requests? A round trip to the database, which must also take data.
    ///
    /// # Errors
    /// [`JobsError::Draining`], or a database that fails or does not answer in time.
    pub async fn ready(&self) -> Result<(), JobsError> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        timeout(READY_WITHIN, self.shared.store.ping())
            .await
            .unwrap_or(Err(JobsError::Database(sqlx::Error::PoolTimedOut)))?;
        self.shared.require_storage().await
    }
}

impl Shared {
    /// The present, epoch milliseconds.
    fn now_ms(&self) -> i64 {
        self.options.clock.now_ms()
    }

    /// The attempts of this process.
    fn running(&self) -> std::sync::MutexGuard<'_, HashMap<Uuid, Arc<Watch>>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells waiting callers that a job has ended.
    fn announce(&self, id: Uuid) {
        // Nobody listening is no error.
        let _ = self.ended.send(id);
    }
}

/// The names of outputs as a JSON list.
fn outputs_text(outputs: &[Output]) -> String {
    serde_json::to_string(outputs).unwrap_or_default()
}

/// Expected solve time in µs.
fn cost_us(problem: &Problem) -> u32 {
    let microseconds = (problem.cost().seconds * 1e6).clamp(1.0, f64::from(i32::MAX));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to what a u32 holds; a NaN becomes 0"
    )]
    {
        microseconds as u32
    }
}

/// The time of submission is the one inside the id, so that order by id is order by time.
fn created_at(id: Uuid) -> i64 {
    i64::try_from(id.as_u128() >> 80).unwrap_or(0)
}
