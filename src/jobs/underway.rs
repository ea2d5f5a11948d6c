//! Batches that are not acknowledged: being received and filled, or given up and to be removed.

use std::collections::HashSet;
use std::sync::{MutexGuard, PoisonError};

use uuid::Uuid;

use crate::jobs::Shared;
use crate::jobs::batch::DELETED_AT_ONCE;
use crate::jobs::error::JobsError;

/// Batches that are not acknowledged.
#[derive(Debug, Default)]
pub(super) struct Underway {
    /// Being received or filled by this process.
    pub(super) living: HashSet<Uuid>,
    /// Those of them whose jobs are being queued: no worker takes one before all are there.
    pub(super) filling: HashSet<Uuid>,
    /// Given up; what is left of them is solved and shown to nobody, and removed as soon as the disk allows it.
    pub(super) abandoned: HashSet<Uuid>,
}

impl Underway {
    /// Batches whose jobs no worker may take.
    pub(super) fn closed_to_workers(&self) -> HashSet<Uuid> {
        self.filling.union(&self.abandoned).copied().collect()
    }

    /// This process neither receives nor fills this batch any more.
    pub(super) fn forget(&mut self, id: Uuid) {
        self.living.remove(&id);
        self.filling.remove(&id);
    }
}

impl Shared {
    /// Batches that are not acknowledged.
    pub(super) fn underway(&self) -> MutexGuard<'_, Underway> {
        self.batches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From now on nobody fills this batch, nobody is shown its jobs, and no worker takes one.
    pub(super) fn abandon(&self, id: Uuid) {
        let mut batches = self.underway();
        batches.forget(id);
        batches.abandoned.insert(id);
    }

    /// Removes what is left of batches that were given up; what cannot be removed now is tried again later.
    pub(super) async fn drop_abandoned(&self) {
        let abandoned: Vec<Uuid> = self.underway().abandoned.iter().copied().collect();
        for id in abandoned {
            let dropped = self.drop_batch(id).await;
            self.note(&dropped);
            match dropped {
                Ok(()) => {
                    self.underway().abandoned.remove(&id);
                    tracing::info!(batch = %id, "batch that was never acknowledged removed");
                }
                Err(error) => {
                    tracing::warn!(batch = %id, %error, "batch that was never acknowledged cannot be removed yet");
                }
            }
        }
        self.collect_blobs().await;
    }

    async fn drop_batch(&self, id: Uuid) -> Result<(), JobsError> {
        while !self.store.drop_batch(id, DELETED_AT_ONCE).await? {}
        Ok(())
    }
}
