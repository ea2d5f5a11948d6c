//! Work of every kind, read and controlled by the same calls. The kind is that of the handle, see [`Jobs::of_kind`].

use std::time::Duration;

use tokio::time::{Instant, timeout_at};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::{BATCH_PAGE_MAX, Jobs, PAGE_MAX};
use crate::jobs::model::batch::Batch;
use crate::jobs::model::job::Job;
use crate::jobs::model::kind::Kind;
use crate::jobs::run::model::Run;
use crate::jobs::store::list::{Filter, Page};

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
