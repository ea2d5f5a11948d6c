//! Waiting for jobs and batches: for their end, or for the next change after a known one.
//!
//! The store is read to find out; announcements only make the next read earlier. Nothing is queued for a client, so that one
//! that does not come back costs nothing.

use std::time::Duration;

use tokio::time::{Instant, sleep, timeout_at};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::job::Job;
use crate::jobs::model::kind::Kind;
use crate::jobs::shared::POLL_INTERVAL;

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
