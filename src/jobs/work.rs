//! Jobs, batches and runs alike: read, listed, waited for, followed, cancelled and deleted.
use std::collections::{HashMap, VecDeque};
use std::time::Duration;

use tokio::time::{Instant, sleep, timeout_at};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::{BATCH_PAGE_MAX, Jobs, PAGE_MAX};
use crate::jobs::model::{Batch, Job, Kind, State};
use crate::jobs::run::model::Run;
use crate::jobs::shared::POLL_INTERVAL;
use crate::jobs::store::{Change, Filter, Membership, Page};

/// Time between two reads of a job or batch of which no change is announced. Within it, what another request has read serves.
const PAUSE: Duration = Duration::from_millis(50);

/// Time between two reads of a batch for each of its jobs: counting them takes time.
const PAUSE_PER_JOB: Duration = Duration::from_micros(10);

impl Jobs {
    /// Waits until a job is at another version than `seen` and returns it; at once if it is, or if nothing was seen yet.
    /// `None` when nothing more will come: the job had ended, or the service is about to stop.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub(crate) async fn job_changed_since(
        &self,
        id: Uuid,
        seen: Option<u64>,
    ) -> Result<Option<Job>, JobsError> {
        // Subscribe first, then read: what ends in between is announced.
        let mut ended = self.shared.ended.subscribe();
        let mut announced = true;
        loop {
            // What others read a moment ago serves, unless something was announced since.
            let job = match announced {
                true => self.get(id).await?,
                false => self.recent(id, PAUSE).await?,
            };
            if seen != Some(job.version) {
                return Ok(Some(job));
            }
            if job.state.ended() {
                return Ok(None);
            }
            let again = Instant::now() + POLL_INTERVAL;
            let end = async {
                // A lagging receiver may have missed the announcement, so it reads again as well.
                while ended.recv().await.is_ok_and(|ended| ended != id) {}
            };
            tokio::select! {
                end = timeout_at(again, end) => announced = end.is_ok(),
                () = self.shared.draining.cancelled() => return Ok(None),
            }
        }
    }

    /// Waits until the jobs of a batch or run are in other states than `seen` says and returns it; at once if they are, or if
    /// nothing was seen yet. `None` when nothing more will come: all jobs had ended, or the service is about to stop.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], or a failed database.
    pub(crate) async fn batch_changed_since(
        &self,
        kind: Kind,
        id: Uuid,
        seen: Option<&str>,
    ) -> Result<Option<Batch>, JobsError> {
        let mut pause = PAUSE;
        loop {
            let batch = match seen {
                None => self.batch(kind, id).await?,
                Some(_) => self.recent_batch(kind, id, pause).await?,
            };
            if seen != Some(&batch.change_tag()) {
                return Ok(Some(batch));
            }
            let (ended, all) = batch.ended();
            if ended == all {
                return Ok(None);
            }
            pause = PAUSE_PER_JOB.saturating_mul(batch.count).max(PAUSE);
            tokio::select! {
                () = sleep(pause) => {}
                () = self.shared.draining.cancelled() => return Ok(None),
            }
        }
    }

    /// As [`Jobs::get`], as the job was a moment ago: one read serves all who follow it.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub(crate) async fn recent(&self, id: Uuid, age: Duration) -> Result<Job, JobsError> {
        let read = self.shared.store.job(&self.tenant, id);
        let job = self
            .shared
            .recent_jobs
            .at(&self.tenant, id, age, read)
            .await?;
        match job {
            Some(job) if !self.sees(&job.labels) => Err(JobsError::NotFound),
            Some(job) => self.unexpired(job),
            None => Err(self.missing(id, JobsError::NotFound).await),
        }
    }

    /// As [`Jobs::batch`], as the batch was a moment ago.
    pub(crate) async fn recent_batch(
        &self,
        kind: Kind,
        id: Uuid,
        age: Duration,
    ) -> Result<Batch, JobsError> {
        let read = self.shared.store.batch(&self.tenant, kind, id);
        let batch = self
            .shared
            .recent_batches
            .at(&self.tenant, id, age, read)
            .await?;
        self.visible(kind, id, batch).await
    }
}

/// What a client has submitted and follows.
#[derive(Debug, Clone)]
pub enum Work {
    /// A job or an evolution.
    Job(Box<Job>),
    /// A batch.
    Batch(Box<Batch>),
    /// A run.
    Run(Box<Run>),
}

impl From<Job> for Work {
    fn from(job: Job) -> Work {
        Work::Job(Box::new(job))
    }
}

impl From<Batch> for Work {
    fn from(batch: Batch) -> Work {
        Work::Batch(Box::new(batch))
    }
}

impl From<Run> for Work {
    fn from(run: Run) -> Work {
        Work::Run(Box::new(run))
    }
}

impl Work {
    /// UUIDv7.
    #[must_use]
    pub fn id(&self) -> Uuid {
        match self {
            Work::Job(job) => job.id,
            Work::Batch(batch) => batch.id,
            Work::Run(run) => run.chunks.id,
        }
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Work::Job(job) => job.kind,
            Work::Batch(_) => Kind::Cases,
            Work::Run(_) => Kind::Rows,
        }
    }

    /// Whether nothing of it will change any more.
    #[must_use]
    pub fn ended(&self) -> bool {
        let all_ended = |batch: &Batch| {
            let (ended, all) = batch.ended();
            ended == all
        };
        match self {
            Work::Job(job) => job.state.ended(),
            Work::Batch(batch) => all_ended(batch),
            Work::Run(run) => all_ended(&run.chunks),
        }
    }

    /// A short text that differs between any two states that a client can tell apart, progress aside.
    #[must_use]
    pub fn version(&self) -> String {
        match self {
            Work::Job(job) => job.version.to_string(),
            Work::Batch(batch) => batch.change_tag(),
            Work::Run(run) => run.chunks.change_tag(),
        }
    }
}

impl Jobs {
    /// Work as it is now; a queued job with its place in the queue.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], [`JobsError::BatchNotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn work(&self, id: Uuid) -> Result<Work, JobsError> {
        match self.kind {
            Kind::Case | Kind::Evolution => Ok(self.get_with_queue_place(id).await?.into()),
            kind => self.work_of(self.batch(kind, id).await?).await,
        }
    }

    /// The batch, or the run that it is.
    pub(crate) async fn work_of(&self, batch: Batch) -> Result<Work, JobsError> {
        match batch.kind {
            Kind::Rows => Ok(self.with_head(batch).await?.into()),
            _ => Ok(batch.into()),
        }
    }

    /// One page of a list, newest first. A page has at most [`PAGE_MAX`] jobs or [`BATCH_PAGE_MAX`] batches.
    ///
    /// # Errors
    /// [`JobsError::BadCursor`], or a failed database.
    pub async fn works(
        &self,
        filter: &Filter,
        cursor: Option<&str>,
        limit: u32,
    ) -> Result<Page<Work>, JobsError> {
        if matches!(self.kind, Kind::Case | Kind::Evolution) {
            let page = self.list(filter, cursor, limit).await?;
            return Ok(page.map(Work::from));
        }
        let (filter, after) = self.narrowed_page(filter, cursor)?;
        let limit = limit.clamp(1, BATCH_PAGE_MAX);
        let store = &self.shared.store;
        let page = store.batches(&self.tenant, &filter, after, limit).await?;
        let mut entries = Vec::with_capacity(page.entries.len());
        for batch in page.entries {
            match self.work_of(batch).await {
                Ok(work) => entries.push(work),
                // Deleted meanwhile, or about to be removed.
                Err(JobsError::BatchNotFound(_) | JobsError::Expired) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Page {
            entries,
            next_cursor: page.next_cursor,
            total: page.total,
        })
    }

    /// One page of the jobs, newest first; `limit` is brought into 1 to [`PAGE_MAX`].
    ///
    /// # Errors
    /// [`JobsError::BadCursor`], or a failed database.
    pub async fn list(
        &self,
        filter: &Filter,
        cursor: Option<&str>,
        limit: u32,
    ) -> Result<Page<Job>, JobsError> {
        let (filter, after) = self.narrowed_page(filter, cursor)?;
        let store = &self.shared.store;
        let mut page = store
            .list(&self.tenant, &filter, after, limit.clamp(1, PAGE_MAX))
            .await?;
        let jobs = page.entries.into_iter();
        page.entries = jobs.filter_map(|job| self.unexpired(job).ok()).collect();
        Ok(page)
    }

    /// The filter, narrowed to what this handle sees, and the entry after which the page begins. The store makes cursors for the narrowed
    /// filter.
    fn narrowed_page(
        &self,
        filter: &Filter,
        cursor: Option<&str>,
    ) -> Result<(Filter, Option<Uuid>), JobsError> {
        let filter = Filter {
            kind: self.kind,
            labels: self.narrowed(&filter.labels),
            ..filter.clone()
        };
        let after = match cursor {
            Some(cursor) => Some(filter.read_cursor(cursor).ok_or(JobsError::BadCursor)?),
            None => None,
        };
        Ok((filter, after))
    }

    /// Waits until work has ended, but not longer than `at_most`, and returns it as it then is. Returns at once when the service is about to
    /// stop.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn wait_for(&self, id: Uuid, at_most: Duration) -> Result<Work, JobsError> {
        let until = Instant::now() + at_most;
        let mut seen = None;
        while let Ok(changed) = timeout_at(until, self.changed_since(id, seen.as_deref())).await {
            let Some(work) = changed? else { break };
            if work.ended() {
                return Ok(work);
            }
            seen = Some(work.version());
        }
        match self.kind {
            // Its place in the queue is for those who look at it.
            Kind::Case | Kind::Evolution => Ok(self.get(id).await?.into()),
            _ => self.work(id).await,
        }
    }

    /// As [`Jobs::wait_for`], for a job.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn wait(&self, id: Uuid, at_most: Duration) -> Result<Job, JobsError> {
        match self.wait_for(id, at_most).await? {
            Work::Job(job) => Ok(*job),
            _ => Err(JobsError::NotFound),
        }
    }

    /// Waits until work is at another version than `seen` and returns it; at once if it is, or if nothing was seen yet. `None` when nothing more will
    /// come: it had ended, or the service is about to stop.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn changed_since(
        &self,
        id: Uuid,
        seen: Option<&str>,
    ) -> Result<Option<Work>, JobsError> {
        match self.kind {
            Kind::Case | Kind::Evolution => {
                let seen = seen.and_then(|text| text.parse().ok());
                Ok(self.job_changed_since(id, seen).await?.map(Work::from))
            }
            kind => match self.batch_changed_since(kind, id, seen).await? {
                Some(batch) => self.work_of(batch).await.map(Some),
                None => Ok(None),
            },
        }
    }

    /// Cancels what has not ended: queued jobs end at once, running ones at the next tick of their solvers. Returns the work as it then is.
    ///
    /// # Errors
    /// As [`Jobs::work`].
    pub async fn cancel_work(&self, id: Uuid) -> Result<Work, JobsError> {
        match self.kind {
            Kind::Case | Kind::Evolution => Ok(self.cancel(id).await?.into()),
            kind => self.work_of(self.cancel_batch(kind, id).await?).await,
        }
    }

    /// Removes ended work with all that belongs to it.
    ///
    /// # Errors
    /// [`JobsError::NotEnded`], [`JobsError::BatchNotEnded`], else as [`Jobs::work`].
    pub async fn delete_work(&self, id: Uuid) -> Result<(), JobsError> {
        match self.kind {
            Kind::Case | Kind::Evolution => self.delete(id).await,
            kind => self.delete_batch(kind, id).await,
        }
    }
}

/// Time between two polls of the store.
const POLL_PAUSE: Duration = Duration::from_millis(250);
/// How far each poll reaches back, in ms.
const REACH_MS: i64 = 2000;
/// Changes read at once; a poll that finds more reads on. Chosen by judgement: a hundred kilobytes, far more than a poll usually finds.
const AT_ONCE: u32 = 1000;
/// Running jobs whose progress is followed.
const RUNNING_MAX: u32 = 100;

/// Where somebody who follows a tenant stands.
#[derive(Debug)]
pub struct Follower {
    jobs: Jobs,
    /// Everything that changed before this time was told.
    since: i64,
    told: VecDeque<(Work, i64)>,
    /// What was told of what changed lately: version of a job with its progress, counts of a batch or run.
    known: HashMap<Uuid, (i64, String)>,
}

impl Jobs {
    /// Follows the tenant from a moment on (epoch milliseconds), or from now on.
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
    /// The moment up to which everything was told, from which another one can go on.
    #[must_use]
    pub fn since(&self) -> i64 {
        self.since
    }

    /// Waits for the next change, with the moment up to which everything was told with it; `None` when the service is about to
    /// stop.
    ///
    /// # Errors
    /// The database failed.
    pub async fn next(&mut self) -> Result<Option<(Work, i64)>, JobsError> {
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

    async fn poll(&mut self) -> Result<(), JobsError> {
        let from = self.since.saturating_sub(REACH_MS);
        self.poll_changes(from).await?;
        self.tell_progress().await?;
        let horizon = self.since.saturating_sub(2 * REACH_MS);
        self.known.retain(|_, (at, _)| *at >= horizon);
        Ok(())
    }

    async fn poll_changes(&mut self, mut from: i64) -> Result<(), JobsError> {
        let mut after = None;
        let mut batches: HashMap<(Kind, Uuid), i64> = HashMap::new();
        loop {
            let store = &self.jobs.shared.store;
            let changes = store
                .changes(&self.jobs.tenant, from, after, AT_ONCE)
                .await?;
            for change in &changes {
                match change.batch {
                    Some(batch) => {
                        let latest = batches.entry((change.kind, batch)).or_insert(change.at);
                        *latest = change.at.max(*latest);
                    }
                    None => self.tell_job(*change).await?,
                }
                self.since = self.since.max(change.at);
            }
            let Some(last) = changes.last().filter(|_| changes.len() == AT_ONCE as usize) else {
                break;
            };
            (from, after) = (last.at, Some(last.id));
        }
        for ((of_job, batch), at) in batches {
            let kind = match of_job {
                Kind::Rows => Kind::Rows,
                _ => Kind::Cases,
            };
            self.emit_batch(kind, batch, at).await?;
        }
        Ok(())
    }

    async fn tell_job(&mut self, change: Change) -> Result<(), JobsError> {
        let job = match self.jobs.recent(change.id, POLL_PAUSE).await {
            Ok(job) => job,
            Err(JobsError::NotFound | JobsError::Expired) => return Ok(()),
            Err(error) => return Err(error),
        };
        self.tell(job.id, change.at, tag(&job), job.into());
        Ok(())
    }

    async fn emit_batch(&mut self, kind: Kind, id: Uuid, at: i64) -> Result<(), JobsError> {
        // Not acknowledged yet, or gone.
        let gone = |error| match error {
            JobsError::BatchNotFound(_) | JobsError::Expired => Ok(()),
            error => Err(error),
        };
        let batch = match self.jobs.recent_batch(kind, id, POLL_PAUSE).await {
            Ok(batch) => batch,
            Err(error) => return gone(error),
        };
        let tag = batch.change_tag();
        if self.is_known(id, &tag) {
            // The head of a run need not be read.
            self.known.insert(id, (at, tag));
            return Ok(());
        }
        match self.jobs.work_of(batch).await {
            Ok(work) => self.tell(id, at, tag, work),
            Err(error) => return gone(error),
        }
        Ok(())
    }

    async fn tell_progress(&mut self) -> Result<(), JobsError> {
        let filter = Filter {
            states: vec![State::Running],
            member: Some(Membership::Alone),
            ..Filter::default()
        };
        for kind in [Kind::Case, Kind::Evolution] {
            let jobs = self.jobs.of_kind(kind);
            let running = jobs.list(&filter, None, RUNNING_MAX).await?.entries;
            for job in running {
                let at = self.since.max(job.updated_at);
                self.tell(job.id, at, tag(&job), job.into());
            }
        }
        Ok(())
    }

    fn is_known(&self, id: Uuid, tag: &str) -> bool {
        self.known.get(&id).is_some_and(|(_, known)| known == tag)
    }

    fn tell(&mut self, id: Uuid, at: i64, tag: String, changed: Work) {
        let known = self.is_known(id, &tag);
        self.known.insert(id, (at, tag));
        if !known {
            self.told.push_back((changed, self.since));
        }
    }
}

fn tag(job: &Job) -> String {
    format!("{} {:.2}", job.version, job.progress)
}
