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
        loop {
            // Subscribe first, then look: what ends in between is announced.
            let mut ended = self.shared.ended.subscribe();
            let job = self.get(id).await?;
            if seen != Some(job.version) {
                return Ok(Some(job));
            }
            if job.state.ended() {
                return Ok(None);
            }
            let again = Instant::now() + LOOK_AGAIN;
            let announced = async {
                sleep(PAUSE).await;
                // A lagging receiver may have missed the announcement, so it looks again as well.
                while ended.recv().await.is_ok_and(|ended| ended != id) {}
            };
            tokio::select! {
                _ = timeout_at(again, announced) => {}
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
        loop {
            let batch = self.batch(id).await?;
            if seen != Some(&batch.mark()) {
                return Ok(Some(batch));
            }
            let (ended, all) = batch.ended();
            if ended == all {
                return Ok(None);
            }
            let pause = PAUSE_PER_JOB.saturating_mul(batch.count).max(PAUSE);
            tokio::select! {
                () = sleep(pause) => {}
                () = self.shared.draining.cancelled() => return Ok(None),
            }
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
