//! Batches and runs as a whole: read, listed, cancelled, deleted.

use uuid::Uuid;

use crate::jobs::attempts::attempt_control::StopReason;
use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::kind::Kind;
use crate::jobs::store::cluster::Notification;

/// Jobs removed in one transaction.
pub(crate) const DELETED_AT_ONCE: u32 = 500;

/// Jobs cancelled in one transaction.
const CANCELLED_AT_ONCE: u32 = 2000;

impl Jobs {
    /// A batch or a run with the counts of its jobs.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn batch(&self, kind: Kind, id: Uuid) -> Result<Batch, JobsError> {
        let batch = self.shared.store.batch(&self.tenant, kind, id).await?;
        self.visible(kind, id, batch).await
    }

    /// A batch that was read, if this handle may see it.
    pub(crate) async fn visible(
        &self,
        kind: Kind,
        id: Uuid,
        batch: Option<Batch>,
    ) -> Result<Batch, JobsError> {
        match batch {
            Some(batch) if batch.kind == kind && self.sees(&batch.labels) => Ok(batch),
            Some(_) => Err(JobsError::BatchNotFound(kind)),
            None => Err(self.missing(id, JobsError::BatchNotFound(kind)).await),
        }
    }

    /// Cancels every job of a batch or run that has not ended: queued ones end at once, running ones at the next tick of
    /// their solvers. Returns the batch as it then is.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], or a failed database.
    pub async fn cancel_batch(&self, kind: Kind, id: Uuid) -> Result<Batch, JobsError> {
        self.batch(kind, id).await?;
        loop {
            let now = self.shared.now_ms();
            let store = &self.shared.store;
            let changed = store
                .cancel_batch(&self.tenant, id, CANCELLED_AT_ONCE, now)
                .await?;
            for (job, state) in &changed {
                if state.ended() {
                    self.shared.metrics.ended(*state, 1);
                    self.shared.announce(*job);
                } else if let Some(control) = self.shared.running.get(*job) {
                    control.stop(StopReason::Cancel);
                } else {
                    self.shared.publish(Notification::Cancel(*job));
                }
            }
            if changed.len() < CANCELLED_AT_ONCE as usize {
                break;
            }
        }
        self.batch(kind, id).await
    }

    /// Removes a batch or run of which every job has ended, with its jobs, their cases and their results. The jobs go in portions, so that
    /// other writers are not held up; if the process dies meanwhile, the rest is still there and can be removed again.
    ///
    /// # Errors
    /// [`JobsError::BatchNotEnded`], [`JobsError::BatchNotFound`], or a failed database.
    pub async fn delete_batch(&self, kind: Kind, id: Uuid) -> Result<(), JobsError> {
        let (ended, all) = self.batch(kind, id).await?.ended();
        if ended < all {
            return Err(JobsError::BatchNotEnded(kind, all - ended));
        }
        let store = &self.shared.store;
        while !store
            .delete_batch(&self.tenant, id, DELETED_AT_ONCE)
            .await?
        {
            self.shared.collect_blobs().await;
        }
        self.shared.collect_blobs().await;
        tracing::info!(batch = %id, jobs = all, "batch deleted");
        Ok(())
    }
}
