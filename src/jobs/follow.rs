//! Following jobs and batches: the next change after the one that was seen.
//!
//! The table is the truth and is looked at; announcements only bring a look forward. Nothing is queued for a follower, so
//! one that does not come back costs nothing.

use std::time::Duration;

use tokio::time::{Instant, sleep, timeout_at};
use uuid::Uuid;

use crate::jobs::batch::Batch;
use crate::jobs::error::JobsError;
use crate::jobs::job::Job;
use crate::jobs::{Jobs, LOOK_AGAIN};

/// Shortest time between two looks of one follower.
const PAUSE: Duration = Duration::from_millis(50);
/// Time between two looks at a batch, for each job of it; counting them takes time too.
const PAUSE_PER_JOB: Duration = Duration::from_micros(10);

impl Jobs {
    /// Waits until a job is at another version than `seen` and returns it; at once if it is, or if nothing was seen yet.
    /// `None` when nothing more will come: the job had ended, or the service is about to stop.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn next_change(&self, id: Uuid, seen: Option<u64>) -> Result<Option<Job>, JobsError> {
        // Subscribe first, then look: what ends in between is announced.
        let mut ended = self.shared.ended.subscribe();
        let mut announced = true;
        loop {
            // A look that others had a moment ago serves, unless something was announced since.
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
            let again = Instant::now() + LOOK_AGAIN;
            let end = async {
                sleep(PAUSE).await;
                // A lagging receiver may have missed the announcement, so it looks again as well.
                while ended.recv().await.is_ok_and(|ended| ended != id) {}
            };
            tokio::select! {
                end = timeout_at(again, end) => announced = end.is_ok(),
                () = self.shared.draining.cancelled() => return Ok(None),
            }
        }
    }

    /// Waits until the jobs of a batch are in other states than `seen` says and returns it; at once if they are, or if
    /// nothing was seen yet. `None` when nothing more will come: all jobs had ended, or the service is about to stop.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], or a failed database.
    pub async fn next_change_of_batch(
        &self,
        id: Uuid,
        seen: Option<&str>,
    ) -> Result<Option<Batch>, JobsError> {
        let mut pause = PAUSE;
        loop {
            let batch = match seen {
                None => self.batch(id).await?,
                Some(_) => self.recent_batch(id, pause).await?,
            };
            if seen != Some(&batch.mark()) {
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
}

impl Jobs {
    /// As [`Jobs::get`], as the job was a moment ago: one look serves all who follow it.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub(super) async fn recent(&self, id: Uuid, age: Duration) -> Result<Job, JobsError> {
        let look = self.shared.store.get(id);
        let job = self.shared.recent_jobs.at(id, age, look).await?;
        match job.filter(|job| *job.tenant == *self.tenant) {
            Some(job) => self.unexpired(job),
            None => Err(self.missing(id, JobsError::NotFound).await),
        }
    }

    /// The same of a batch.
    async fn recent_batch(&self, id: Uuid, age: Duration) -> Result<Batch, JobsError> {
        let look = self.shared.store.batch(id);
        let batch = self.shared.recent_batches.at(id, age, look).await?;
        match batch.filter(|batch| *batch.tenant == *self.tenant) {
            Some(batch) => Ok(batch),
            None => Err(self.missing(id, JobsError::BatchNotFound).await),
        }
    }
}

impl Batch {
    /// A short text that differs between any two states of the batch that a client can tell apart.
    #[must_use]
    pub fn mark(&self) -> String {
        let counts: Vec<String> = self.states.values().map(ToString::to_string).collect();
        counts.join("-")
    }
}
