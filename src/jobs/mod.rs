//! Who solves what, when, and what became of it? [`Jobs`] is all that the outside may call.
//!
//! A job is a row of the job table ([`store`]); its case hangs on the row, its result lies outside the table
//! ([`results`], [`fields`]). Workers ([`worker`]) claim the oldest queued job under a lease, solve it on a thread of
//! their own and finish it; a claim's lease number fences every later write. [`lifecycle`] opens, starts
//! and stops all this. A process that dies leaves `running` rows,
//! which go back to the queue when the data folder is opened again.

mod attempt;
pub mod backup;
pub mod batch;
pub mod clock;
pub mod draft;
pub mod error;
pub mod fetch;
pub mod fields;
mod follow;
pub mod gate;
mod housekeeping;
mod idempotency;
pub mod job;
mod keeper;
pub mod keys;
mod leaps;
pub mod lifecycle;
mod metrics;
mod part;
mod recent;
pub mod recipe;
mod reserve;
pub mod results;
pub mod retention;
mod reuse;
mod settle;
mod solver_thread;
mod spool;
pub mod staging;
mod storage;
pub mod store;
mod submit;
pub mod sweep;
pub mod template;
pub mod trace;
mod turns;
mod underway;
mod verdict;
pub mod watch;
pub mod wishes;
pub mod worker;

use std::collections::HashMap;
use std::fs::File;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::{Notify, Semaphore, SetOnce, broadcast};
use tokio::time::{Instant, timeout, timeout_at};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::Uuid;

use crate::contact::case::problem::Problem;
use crate::contact::error::CaseError;
use crate::jobs::batch::Batch;
pub use crate::jobs::error::JobsError;
pub use crate::jobs::job::{Failure, FailureKind, Job, QueuePlace, State};
use crate::jobs::keys::Trusted;
use crate::jobs::leaps::Leaps;
pub use crate::jobs::lifecycle::Options;
use crate::jobs::metrics::Metrics;
use crate::jobs::recent::RecentLooks;
use crate::jobs::recipe::Recipe;
use crate::jobs::results::Results;
use crate::jobs::staging::Staged;
pub use crate::jobs::storage::Trouble;
use crate::jobs::store::Deleted;
pub use crate::jobs::store::list::{Filter, Page};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::turns::Turns;
use crate::jobs::underway::Underway;
use crate::jobs::watch::{Reason, Watch};

/// Longest list page.
pub const PAGE_MAX: u32 = 1000;
/// Places of the queue beyond which a job is not told its own.
const PLACES_COUNTED: u32 = 10_000;
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
    /// Batches and jobs that somebody follows, as they were a moment ago.
    recent_batches: RecentLooks<Option<Batch>>,
    recent_jobs: RecentLooks<Option<Job>>,
    /// What became of the wall clock.
    leaps: Leaps,
    /// Whose turn it is, and solves that wait for theirs.
    turns: Turns,
    /// Held by all that is solved; alone by what may have killed a process.
    solo: Arc<tokio::sync::RwLock<()>>,
    /// Attempts that wait to be solved alone.
    suspects_waiting: AtomicUsize,
    /// Solver threads that did not stop and still run.
    abandoned: Arc<AtomicUsize>,
    /// Set when there are too many of them.
    broken: CancellationToken,
    /// What a dead process left is taken back; nothing is claimed before.
    recovered: SetOnce<()>,
    /// Held as long as this process uses the data folder.
    lock: Mutex<Option<File>>,
}

impl Jobs {
    /// How jobs are kept and worked on here.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.shared.options
    }

    /// Checks a case against the limits of this service.
    ///
    /// # Errors
    /// Every fault of the case.
    pub fn check(&self, case: &Value) -> Result<Problem, CaseError> {
        (self.shared.recipe.check)(case, &self.shared.options.limits)
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

    /// As [`Jobs::get`], with the place of a queued job among the others; without it where too many come before.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn look(&self, id: Uuid) -> Result<Job, JobsError> {
        let mut job = self.get(id).await?;
        if job.state != State::Queued {
            return Ok(job);
        }
        let store = &self.shared.store;
        let (before, cost_us, tenants) = store.queued_before(&job, PLACES_COUNTED).await?;
        if let Ok(position) = u32::try_from(before)
            && position < PLACES_COUNTED
        {
            #[expect(clippy::cast_precision_loss, reason = "rough")]
            let seconds = cost_us as f64 * 1e-6;
            // Each of the tenants has as much solver time as this one, until its own queue is empty.
            #[expect(clippy::cast_precision_loss, reason = "rough")]
            let share = tenants.max(1) as f64 / self.shared.options.workers.max(1) as f64;
            job.queue = Some(QueuePlace {
                position,
                starts_in_s: seconds * share,
            });
        }
        Ok(job)
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

    /// Milliseconds of a clock that nobody turns; leases are measured with it.
    fn steady_ms(&self) -> i64 {
        self.options.clock.steady_ms()
    }

    /// The time from a claim or a heartbeat until the job is given away, in ms.
    fn lease_ms(&self) -> i64 {
        i64::try_from(self.options.lease.as_millis()).unwrap_or(i64::MAX)
    }

    /// When a lease that begins now runs out.
    fn lease_until(&self) -> i64 {
        self.steady_ms().saturating_add(self.lease_ms())
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
