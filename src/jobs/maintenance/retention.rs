//! How long ended jobs are kept, and what is done with those that have expired.
//!
//! An expired job is removed with its case and its result. Its id is kept for a while, so that a client that comes too late
//! gets "expired" and not "not found".

use std::sync::Arc;
use std::time::Duration;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::job::Job;
use crate::jobs::shared::Shared;
use crate::jobs::store::retention::RetentionRule;

/// How long the ids of expired jobs and batches are remembered.
pub const REMEMBERED_FOR: Duration = Duration::from_secs(30 * 24 * 3600);

/// Jobs removed in one transaction.
const SWEEP_JOBS: u32 = 500;

/// Free pages of the database given back to the file system in one step.
const SHRINK_PAGES: u32 = 2000;

/// Free pages that stay in the database file for what comes next.
const SPARE_PAGES: i64 = 4000;

/// Pause between two steps, in which others may write.
const PAUSE: Duration = Duration::from_millis(20);

/// Longest and shortest time between two sweeps.
const SWEEP_EVERY: (Duration, Duration) = (Duration::from_secs(60), Duration::from_secs(1));

impl Jobs {
    /// Removes every ended job whose time is over, batches of which nothing is left, and ids remembered long enough;
    /// gives free space of the database back. Returns the number of jobs removed. A running service does this by
    /// itself.
    ///
    /// # Errors
    /// The database failed; the next sweep will go on.
    pub async fn sweep_expired(&self) -> Result<u64, JobsError> {
        self.shared.sweep_expired().await
    }
}

impl Shared {
    pub(crate) fn expires_at(&self, job: &Job) -> Option<i64> {
        let kept = millis(self.options.retention?);
        job.ended_at.map(|ended| ended.saturating_add(kept))
    }

    async fn sweep_expired(&self) -> Result<u64, JobsError> {
        let now = self.now_ms();
        let mut removed = 0;
        let clock_leapt = self.clock_step().ms > 0;
        if clock_leapt {
            tracing::warn!("the clock was set forward; nothing is removed before the next start");
        }
        if let Some(retention) = self.options.retention.filter(|_| !clock_leapt) {
            let expiry = RetentionRule {
                now,
                ended_before: now.saturating_sub(millis(retention)),
                forget_before: now.saturating_sub(millis(REMEMBERED_FOR)),
                jobs: SWEEP_JOBS,
            };
            loop {
                let expired = self.store.expire(expiry).await?;
                removed += expired;
                if expired < u64::from(SWEEP_JOBS) {
                    break;
                }
                tokio::time::sleep(PAUSE).await;
            }
        }
        self.collect_blobs().await;
        while self.store.compact(SPARE_PAGES, SHRINK_PAGES).await? {
            tokio::time::sleep(PAUSE).await;
        }
        Ok(removed)
    }
}

/// Sweeps until the service drains.
pub(crate) async fn sweep(shared: Arc<Shared>) {
    let (longest, shortest) = SWEEP_EVERY;
    let retention = shared.options.retention.unwrap_or(longest);
    let mut beat = tokio::time::interval((retention / 10).clamp(shortest, longest));
    let draining = shared.draining.clone();
    while draining.run_until_cancelled(beat.tick()).await.is_some() {
        match draining.run_until_cancelled(shared.sweep_expired()).await {
            Some(Ok(0)) | None => {}
            Some(Ok(removed)) => tracing::info!(removed, "expired jobs removed"),
            Some(Err(error)) => tracing::warn!(%error, "expired jobs could not be removed"),
        }
    }
}

fn millis(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}
