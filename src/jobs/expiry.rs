//! Which jobs are still there for clients, and which have expired.

use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::Job;

impl Jobs {
    /// The job with the time at which it will expire.
    pub(crate) fn dated(&self, mut job: Job) -> Job {
        job.expires_at = self.shared.expires_at(&job);
        job
    }

    /// The job with that time, unless it is over, or belongs to a batch that was never acknowledged.
    pub(crate) fn unexpired(&self, job: Job) -> Result<Job> {
        let job = self.dated(job);
        if let Some(batch) = &job.batch_id
            && self.shared.unfinished_batches().abandoned.contains(batch)
        {
            return Err(JobsError::NotFound(self.kind));
        }
        let now = self.shared.now_ms();
        let now = job
            .ended_at
            .map_or(now, |ended| self.shared.clock_step().now_for(ended, now));
        match job.expires_at {
            Some(time) if time <= now => Err(JobsError::Expired),
            _ => Ok(job),
        }
    }

    /// Why there is nothing with this id for this tenant.
    pub(crate) async fn missing(&self, id: Uuid) -> JobsError {
        match self.shared.store.has_expired(&self.tenant, id).await {
            Ok(true) => JobsError::Expired,
            Ok(false) => JobsError::NotFound(self.kind),
            Err(error) => error.into(),
        }
    }
}
