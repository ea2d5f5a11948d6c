//! Takes back what a dead process left, for as long as the disk does not allow it.

use std::sync::Arc;
use std::time::Duration;

use crate::jobs::disk_reserve;
use crate::jobs::error::JobsError;
use crate::jobs::shared::Shared;
use crate::jobs::storage_fault::StoragePlace;
use crate::jobs::store::claim::Reap;

/// Time between two tries to do what a full disk did not allow.
const RECOVER_EVERY: Duration = Duration::from_secs(1);

/// Time between two checks of the disk reserve.
const RESERVE_EVERY: Duration = Duration::from_secs(60);

/// Takes back what a dead process left, and removes what is left of batches that were given up, again and again for as
/// long as the disk does not allow it.
pub(crate) async fn recover(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(RECOVER_EVERY);
    let mut reserved = tokio::time::Instant::now();
    while shared
        .draining
        .run_until_cancelled(beat.tick())
        .await
        .is_some()
    {
        if shared.recovered.get().is_none()
            && let Err(error) = shared.recover().await
        {
            tracing::warn!(%error, "jobs of a dead process cannot be taken back yet");
        }
        if !shared.unfinished_batches().abandoned.is_empty() {
            shared.drop_abandoned().await;
        }
        if shared.storage.any() {
            // The outcome is noted; what fails is tried again at the next time.
            let tried = shared.require_storage();
            let _ = shared.draining.run_until_cancelled(tried).await;
        } else if reserved.elapsed() >= RESERVE_EVERY {
            reserved = tokio::time::Instant::now();
            let data_dir = shared.options.data_dir.clone();
            // It is tried again at the next time.
            let _ = tokio::task::spawn_blocking(move || disk_reserve::keep(&data_dir)).await;
        }
    }
}

impl Shared {
    /// Takes back the jobs that a dead process was running.
    pub(crate) async fn recover(&self) -> Result<(), JobsError> {
        if self.recovered.get().is_some() {
            return Ok(());
        }
        if self.store.cluster().is_some() {
            // What runs is of other processes, as long as their leases last.
            let _ = self.recovered.set(());
            return Ok(());
        }
        let attempts_max = self.options.attempts_max;
        let taken = self
            .store
            .reap(Reap::Dead, self.now_ms(), attempts_max)
            .await;
        let taken = taken.map_err(JobsError::from);
        self.observe_storage(StoragePlace::Table, &taken);
        for (id, state) in taken? {
            tracing::info!(job = %id, state = state.name(), "job of a dead process taken back");
        }
        // Set once; whoever was first is right.
        let _ = self.recovered.set(());
        if !self.unfinished_batches().abandoned.is_empty() {
            self.drop_abandoned().await;
        }
        Ok(())
    }
}
