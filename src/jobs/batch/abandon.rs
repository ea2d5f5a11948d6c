//! Removes batches that were given up.

use uuid::Uuid;

use crate::jobs::batch::control::DELETED_AT_ONCE;
use crate::jobs::error::JobsError;
use crate::jobs::shared::Shared;
use crate::jobs::storage_fault::StoragePlace;

impl Shared {
    /// From now on this batch is not filled, its jobs are not shown, and no worker takes one.
    pub(crate) fn abandon(&self, id: Uuid) {
        let mut batches = self.unfinished_batches();
        batches.forget(id);
        batches.abandoned.insert(id);
    }

    /// Removes what is left of batches that were given up; what cannot be removed now is tried again later.
    pub(crate) async fn drop_abandoned(&self) {
        let abandoned: Vec<Uuid> = self
            .unfinished_batches()
            .abandoned
            .iter()
            .copied()
            .collect();
        for id in abandoned {
            let dropped = self.drop_batch(id).await;
            self.observe_storage(StoragePlace::Table, &dropped);
            match dropped {
                Ok(()) => {
                    self.unfinished_batches().abandoned.remove(&id);
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
