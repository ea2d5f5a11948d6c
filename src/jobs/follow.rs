//! Reads, lists, waits for, follows, cancels and deletes work of every kind.
use std::collections::{HashMap, VecDeque};
use std::future::pending;
use std::time::Duration;

use tokio::time::{Instant, sleep, timeout, timeout_at};
use uuid::Uuid;

use crate::attempts::attempt::StopReason;
use crate::batch::control::DELETED_AT_ONCE;
use crate::error::{JobsError, Result, StoreError};
use crate::handle::{BATCH_PAGE_MAX, Jobs, PAGE_MAX};
use crate::model::{Job, Kind, QueuePlace, State};
use crate::run::model::{Run, RunHead};
use crate::shared::POLL_INTERVAL;
use crate::store::{Filter, Membership, Notification, Page};
use crate::work::Work;

/// Interval between two reads of work without an announcement. Within it, the read of another request is reused.
const PAUSE: Duration = Duration::from_millis(50);

/// Additional interval between two reads of a batch for each of its jobs, because counting them takes time.
const PAUSE_PER_JOB: Duration = Duration::from_micros(10);

/// Positions in the queue from this one on are not reported.
const PLACES_COUNTED: u32 = 10_000;

/// Number of jobs of a batch that are cancelled in one transaction.
const CANCELLED_AT_ONCE: u32 = 2000;

impl Jobs {
    /// Reads work, or reuses a read that is at most `age` old, so that one read serves all followers. A run is returned as a batch.
    async fn read(&self, id: Uuid, age: Duration) -> Result<Work> {
        let (shared, tenant) = (&self.shared, &self.tenant);
        let read = async {
            Ok::<_, StoreError>(match self.kind {
                Kind::Case | Kind::Evolution => shared.store.job(tenant, id).await?.map(Work::from),
                kind => shared.store.batch(tenant, kind, id).await?.map(Work::from),
            })
        };
        let owned = (tenant.clone(), self.kind, id);
        match shared.recent.at(owned, age, read).await? {
            Some(work) if work.kind() != self.kind || !self.sees(work.labels()) => {
                Err(JobsError::NotFound(self.kind))
            }
            Some(Work::Job(job)) => Ok(self.unexpired(*job)?.into()),
            Some(work) => Ok(work),
            None => Err(self.missing(id).await),
        }
    }

    /// Prepares work for clients: checks that a job has not expired, and adds the head of a run.
    async fn shown(&self, work: Work) -> Result<Work> {
        let batch = match work {
            Work::Job(job) => return Ok(self.unexpired(*job)?.into()),
            Work::Batch(batch) if batch.kind == Kind::Rows => *batch,
            work => return Ok(work),
        };
        let (_, there) = batch.ended();
        if there < u64::from(batch.count) {
            // Its first chunks have expired, or it is being deleted.
            return Err(JobsError::Expired);
        }
        let record = self.shared.store.run(&self.tenant, batch.id).await?;
        let record = record.ok_or(JobsError::NotFound(Kind::Rows))?;
        let head = RunHead::read(&record.template, record.head.as_deref())?;
        Ok(Work::Run(Box::new(Run::new(batch, head, &record))))
    }

    /// Reads a job.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn get(&self, id: Uuid) -> Result<Job> {
        self.read(id, Duration::ZERO).await?.job()
    }

    /// Reads a run.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn run(&self, id: Uuid) -> Result<Run> {
        match self.of_kind(Kind::Rows).work(id).await? {
            Work::Run(run) => Ok(*run),
            _ => Err(JobsError::NotFound(Kind::Rows)),
        }
    }

    /// Reads work; a queued job with its position in the queue, unless it is too far back.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn work(&self, id: Uuid) -> Result<Work> {
        let mut work = self.read(id, Duration::ZERO).await?;
        if let Work::Job(job) = &mut work
            && job.state == State::Queued
        {
            job.queue = self.queue_place(job).await?;
        }
        self.shown(work).await
    }

    async fn queue_place(&self, job: &Job) -> Result<Option<QueuePlace>> {
        let store = &self.shared.store;
        let ahead = store.queued_before(job, PLACES_COUNTED).await?;
        let position = u32::try_from(ahead.jobs).ok();
        #[expect(clippy::cast_precision_loss, reason = "rough")]
        let seconds = ahead.cost_us as f64 * 1e-6;
        // Each tenant gets as much solver time as this one, until its own queue is empty.
        #[expect(clippy::cast_precision_loss, reason = "rough")]
        let share = ahead.tenants.max(1) as f64 / self.shared.all_workers().max(1) as f64;
        let position = position.filter(|position| *position < PLACES_COUNTED);
        Ok(position.map(|position| QueuePlace {
            position,
            starts_in_s: seconds * share,
        }))
    }

    /// Reads one page of a list, newest first, of at most [`PAGE_MAX`] jobs or [`BATCH_PAGE_MAX`] batches.
    ///
    /// # Errors
    /// [`JobsError::BadCursor`], or a failed database.
    pub async fn list(
        &self,
        filter: &Filter,
        cursor: Option<&str>,
        limit: u32,
    ) -> Result<Page<Work>> {
        // The store creates cursors for the restricted filter.
        let filter = Filter {
            kind: self.kind,
            labels: self.narrowed(&filter.labels),
            ..filter.clone()
        };
        let after = match cursor {
            Some(cursor) => Some(filter.read_cursor(cursor).ok_or(JobsError::BadCursor)?),
            None => None,
        };
        let (store, tenant) = (&self.shared.store, &self.tenant);
        let mut page = match self.kind {
            Kind::Case | Kind::Evolution => {
                let limit = limit.clamp(1, PAGE_MAX);
                let page = store.list(tenant, &filter, after, limit).await?;
                page.map(Work::from)
            }
            _ => {
                let limit = limit.clamp(1, BATCH_PAGE_MAX);
                let page = store.batches(tenant, &filter, after, limit).await?;
                page.map(Work::from)
            }
        };
        for work in std::mem::take(&mut page.entries) {
            match self.shown(work).await {
                Ok(work) => page.entries.push(work),
                // Deleted in the meantime, or about to be removed.
                Err(JobsError::NotFound(_) | JobsError::Expired) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(page)
    }

    /// Waits until work has ended, for at most `at_most`, and returns its last state. Returns at once when the service
    /// begins to stop.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn wait_for(&self, id: Uuid, at_most: Duration) -> Result<Work> {
        let ended = self.read_until(id, Duration::ZERO, Work::ended);
        if let Ok(ended) = timeout(at_most, ended).await
            && let Some(work) = ended?
        {
            return Ok(work);
        }
        // Without the position in the queue, which takes another query.
        let work = self.read(id, Duration::ZERO).await?;
        self.shown(work).await
    }

    /// As [`Jobs::wait_for`], for a job.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn wait(&self, id: Uuid, at_most: Duration) -> Result<Job> {
        self.wait_for(id, at_most).await?.job()
    }

    /// Waits until the version of the work differs from `seen` and returns the work; returns at once if nothing was seen
    /// yet. `None` if no further change follows: the work had ended, or the service begins to stop.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn changed_since(&self, id: Uuid, seen: Option<&str>) -> Result<Option<Work>> {
        let age = match (self.kind, seen) {
            (Kind::Cases | Kind::Rows, Some(_)) => PAUSE,
            _ => Duration::ZERO,
        };
        self.read_until(id, age, |work| seen != Some(&work.version()))
            .await
    }

    /// Reads work until it is as `wanted`. The first read may be `age` old. `None` if the work had ended, or the service begins to stop.
    async fn read_until(
        &self,
        id: Uuid,
        mut age: Duration,
        wanted: impl Fn(&Work) -> bool,
    ) -> Result<Option<Work>> {
        // Subscribe before reading, so that the end of a job in between is announced. Changes of batches are not announced.
        let mut ended = self.shared.ended.subscribe();
        loop {
            let work = self.read(id, age).await?;
            if wanted(&work) {
                return self.shown(work).await.map(Some);
            }
            if work.ended() {
                return Ok(None);
            }
            let pause = match &work {
                Work::Batch(batch) => PAUSE_PER_JOB.saturating_mul(batch.count).max(PAUSE),
                _ => POLL_INTERVAL,
            };
            let announced = async {
                match &work {
                    // A receiver that lags may have missed the announcement, so the job is read again.
                    Work::Job(_) => while ended.recv().await.is_ok_and(|ended| ended != id) {},
                    _ => pending().await,
                }
            };
            tokio::select! {
                // A recent read of another request is reused, unless something was announced since.
                announced = timeout_at(Instant::now() + pause, announced) => age = match (announced, &work) {
                    (Ok(()), _) => Duration::ZERO,
                    (_, Work::Job(_)) => PAUSE,
                    _ => pause,
                },
                () = self.shared.draining.cancelled() => return Ok(None),
            }
        }
    }

    /// Cancels work: queued jobs end at once, running jobs at the next tick of their solvers. Returns the state after that.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn cancel(&self, id: Uuid) -> Result<Work> {
        let (store, tenant) = (&self.shared.store, &self.tenant);
        let now = self.shared.now_ms();
        if let Work::Job(_) = self.read(id, Duration::ZERO).await? {
            let job = store.cancel(tenant, id, now).await?;
            let job = job.ok_or(JobsError::NotFound(self.kind))?;
            let ends_now = job.state == State::Cancelled && job.ended_at == Some(now);
            if ends_now || !job.state.ended() {
                self.announce_cancelled(id, job.state);
            }
            return Ok(self.dated(job).into());
        }
        loop {
            let changed = store
                .cancel_batch(tenant, id, CANCELLED_AT_ONCE, now)
                .await?;
            for (job, state) in &changed {
                self.announce_cancelled(*job, *state);
            }
            if changed.len() < CANCELLED_AT_ONCE as usize {
                return self.work(id).await;
            }
        }
    }

    /// Announces a cancelled job to waiting callers, and stops its solver.
    fn announce_cancelled(&self, job: Uuid, state: State) {
        let shared = &self.shared;
        if state.ended() {
            shared.metrics.ended(state, 1);
            shared.announce(job);
        } else if !shared.leases.stop(job, StopReason::Cancel) {
            // A worker that claims the job later reads the request from the store.
            shared.publish(Notification::Cancel(job));
        }
    }

    /// Removes ended work with its jobs, cases and results. Jobs of a batch are removed in portions, so that other writers
    /// are not blocked. After a crash in between, the rest can be deleted again.
    ///
    /// # Errors
    /// [`JobsError::NotEnded`], else as [`Jobs::work`].
    pub async fn delete(&self, id: Uuid) -> Result<()> {
        let (shared, tenant) = (&self.shared, &self.tenant);
        let work = self.read(id, Duration::ZERO).await?;
        if !work.ended() {
            return Err(JobsError::NotEnded(self.kind));
        }
        if let Work::Job(_) = work {
            if !shared.store.delete(tenant, id).await? {
                return Err(JobsError::NotFound(self.kind));
            }
        } else {
            while !shared
                .store
                .delete_batch(tenant, id, DELETED_AT_ONCE)
                .await?
            {
                shared.collect_blobs().await;
            }
            tracing::info!(batch = %id, "batch deleted");
        }
        shared.collect_blobs().await;
        Ok(())
    }
}

/// Interval between two polls of the store by a follower.
const POLL_PAUSE: Duration = Duration::from_millis(250);
/// How far each poll reaches back in ms, so that late commits are found.
const REACH_MS: i64 = 2000;
/// Number of changes read at once; a poll that finds more continues. Chosen by judgement: about 100 kB.
const AT_ONCE: u32 = 1000;
/// Maximum number of running jobs whose progress is reported.
const RUNNING_MAX: u32 = 100;

/// Iterates over the changes of the work of a tenant.
#[derive(Debug)]
pub struct Follower {
    jobs: Jobs,
    /// Changes before this time have been returned.
    since: i64,
    /// Changes to be returned, each with the time up to which all changes were returned.
    told: VecDeque<(Work, i64)>,
    /// The last reported state of recently changed work, with its time.
    known: HashMap<Uuid, (i64, String)>,
}

impl Jobs {
    /// Follows the changes of the tenant's work from a time on (epoch milliseconds; default: now).
    #[must_use]
    pub fn follow(&self, since: Option<i64>) -> Follower {
        Follower {
            jobs: self.clone(),
            since: since.unwrap_or_else(|| self.shared.now_ms()),
            told: VecDeque::new(),
            known: HashMap::new(),
        }
    }
}

impl Follower {
    /// The time up to which all changes were returned, from which another follower can continue.
    #[must_use]
    pub fn since(&self) -> i64 {
        self.since
    }

    /// Waits for the next change and returns it with the time up to which all changes were returned. `None` when the
    /// service begins to stop.
    ///
    /// # Errors
    /// The database failed.
    pub async fn next(&mut self) -> Result<Option<(Work, i64)>> {
        let shared = self.jobs.shared.clone();
        loop {
            if let Some(next) = self.told.pop_front() {
                return Ok(Some(next));
            }
            self.poll().await?;
            if self.told.is_empty() {
                tokio::select! {
                    () = sleep(POLL_PAUSE) => {}
                    () = shared.draining.cancelled() => return Ok(None),
                }
            }
        }
    }

    async fn poll(&mut self) -> Result<()> {
        let from = self.since.saturating_sub(REACH_MS);
        self.poll_changes(from).await?;
        self.tell_progress().await?;
        let horizon = self.since.saturating_sub(2 * REACH_MS);
        self.known.retain(|_, (at, _)| *at >= horizon);
        Ok(())
    }

    async fn poll_changes(&mut self, mut from: i64) -> Result<()> {
        let mut after = None;
        let mut changed: HashMap<(Kind, Uuid), i64> = HashMap::new();
        loop {
            let store = &self.jobs.shared.store;
            let changes = store
                .changes(&self.jobs.tenant, from, after, AT_ONCE)
                .await?;
            for change in &changes {
                let work = match (change.batch, change.kind) {
                    (None, kind) => (kind, change.id),
                    (Some(run), Kind::Rows) => (Kind::Rows, run),
                    (Some(batch), _) => (Kind::Cases, batch),
                };
                let latest = changed.entry(work).or_insert(change.at);
                *latest = change.at.max(*latest);
            }
            let Some(last) = changes.last().filter(|_| changes.len() == AT_ONCE as usize) else {
                break;
            };
            (from, after) = (last.at, Some(last.id));
        }
        let mut changed: Vec<_> = changed.into_iter().collect();
        changed.sort_unstable_by_key(|(_, at)| *at);
        for ((kind, id), at) in changed {
            self.since = self.since.max(at);
            let jobs = self.jobs.of_kind(kind);
            let told = match jobs.read(id, POLL_PAUSE).await {
                Ok(work) => self.tell(at, work).await,
                Err(error) => Err(error),
            };
            match told {
                // Not acknowledged yet, or gone.
                Ok(()) | Err(JobsError::NotFound(_) | JobsError::Expired) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    async fn tell_progress(&mut self) -> Result<()> {
        let filter = Filter {
            states: vec![State::Running],
            member: Some(Membership::Alone),
            ..Filter::default()
        };
        for kind in [Kind::Case, Kind::Evolution] {
            let jobs = self.jobs.of_kind(kind);
            for work in jobs.list(&filter, None, RUNNING_MAX).await?.entries {
                let job = work.job()?;
                let at = self.since.max(job.updated_at);
                self.tell(at, job.into()).await?;
            }
        }
        Ok(())
    }

    /// Records the state of work, and queues an event unless this state was reported before.
    async fn tell(&mut self, at: i64, work: Work) -> Result<()> {
        let (id, tag) = (work.id(), tag(&work));
        if self.known.get(&id).is_none_or(|(_, known)| *known != tag) {
            let work = self.jobs.of_kind(work.kind()).shown(work).await?;
            self.told.push_back((work, self.since));
        }
        self.known.insert(id, (at, tag));
        Ok(())
    }
}

/// A text that differs between any two reported states, with progress in percent.
fn tag(work: &Work) -> String {
    match work {
        Work::Job(job) => format!("{} {:.2}", job.version, job.progress),
        work => work.version(),
    }
}
