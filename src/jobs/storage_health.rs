//! Behaviour while storage is full or cannot be written: nothing that was accepted is lost, and the service is not ready.
//!
//! A result that cannot be stored stays in memory while its worker repeats the write.
//!
//! Each [`StoragePlace`] fails separately. Its fault ends with the next successful write there. While a writer repeats its
//! write, only that write ends the fault, because smaller ones may still find room.

use std::future::Future;
use std::time::Duration;

use crate::data_dir;
use crate::error::{JobsError, Result, StorageFault, StoreError};
use crate::handle::Jobs;
use crate::shared::Shared;
use crate::storage_fault::{FaultChange, StoragePlace};
use crate::sync::blocking;

/// Number of attempts to write if storage is not the cause. Pauses double from [`FIRST_PAUSE`].
const WRITE_TRIES: u32 = 6;

const FIRST_PAUSE: Duration = Duration::from_millis(50);

/// Longest pause between two attempts.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

impl Jobs {
    /// Records the outcome of a write to the job table. After a fault the service is not ready until a write succeeds.
    pub(crate) fn observe_write<T, E: Into<JobsError>>(&self, written: Result<T, E>) -> Result<T> {
        let written = written.map_err(Into::into);
        self.shared.observe_storage(StoragePlace::Table, &written);
        written
    }

    /// The error for a failed read or write of a spool file, whose fault is recorded.
    #[must_use]
    pub fn spool_failed(&self, source: std::io::Error) -> JobsError {
        let error = JobsError::at(&self.shared.options.data_dir)(source);
        if let Some(fault) = error.storage_fault() {
            self.shared.note_fault(StoragePlace::Spool, Some(fault));
        }
        error
    }
}

impl Shared {
    /// Records the outcome of a write to a location.
    pub(crate) fn observe_storage<T>(&self, place: StoragePlace, written: &Result<T>) {
        match written {
            Ok(_) => self.note_fault(place, None),
            // Filling a batch also reads its spool file, whose faults are recorded where they occur.
            Err(error) if place == StoragePlace::Table && !matches!(error, JobsError::Store(_)) => {
            }
            Err(error) => {
                if let Some(fault) = error.storage_fault() {
                    self.note_fault(place, Some(fault));
                }
            }
        }
    }

    fn note_fault(&self, place: StoragePlace, fault: Option<StorageFault>) {
        match (self.storage.note(place, fault), fault) {
            (FaultChange::Begun, Some(StorageFault::Unreachable)) => {
                tracing::error!(
                    ?place,
                    "the database or the store of results cannot be reached"
                );
            }
            (FaultChange::Begun, Some(fault)) => {
                tracing::error!(?place, ?fault, "the disk takes nothing");
            }
            (FaultChange::AllOver, _) if self.store.cluster().is_some() => {
                tracing::info!("the database accepts writes again");
            }
            (FaultChange::AllOver, _) => tracing::info!("the disk accepts writes again"),
            _ => {}
        }
    }

    /// Writes to a location with retries: a few times if the database fails, and without limit while storage is full or
    /// cannot be written. Gives up when the service stops.
    pub(crate) async fn write_with_retries<T, E, F>(
        &self,
        place: StoragePlace,
        mut write: impl FnMut() -> F,
    ) -> Result<T>
    where
        F: Future<Output = Result<T, E>>,
        E: Into<JobsError>,
    {
        let (mut pause, mut tries) = (FIRST_PAUSE, 1);
        let mut waiting = None;
        loop {
            let written = write().await.map_err(Into::into);
            if written.is_ok() {
                drop(waiting.take());
            }
            self.observe_storage(place, &written);
            let Err(error) = &written else { return written };
            let waits = error.storage_fault().is_some() && !self.stopping.is_cancelled();
            let again = matches!(error, JobsError::Store(_)) && tries < WRITE_TRIES;
            if !waits && !again {
                return written;
            }
            if waits && waiting.is_none() {
                waiting = Some(self.storage.wait(place));
            }
            tracing::warn!(?place, %error, "could not be written yet");
            tokio::select! {
                () = tokio::time::sleep(pause) => {}
                () = self.stopping.cancelled(), if waits => {}
            }
            pause = (pause * 2).min(LONGEST_PAUSE);
            tries += 1;
        }
    }

    /// The error for a store that does not answer in time.
    pub(crate) fn silent_store(&self) -> StoreError {
        match (StoreError::timed_out(), self.store.cluster()) {
            (StoreError::Away(_, cause), Some(_)) => {
                StoreError::Away(StorageFault::Unreachable, cause)
            }
            (error, _) => error,
        }
    }

    /// Requires that all locations accept writes; writes only to those with a recorded fault.
    pub(crate) async fn require_storage(&self) -> Result<()> {
        for place in StoragePlace::ALL {
            let Some((fault, waited_for)) = self.storage.fault(place) else {
                continue;
            };
            if fault == StorageFault::Damaged {
                let reason = "the job table is damaged; stop the service and restore a backup";
                return Err(StoreError::away(fault, reason).into());
            }
            if waited_for {
                let reason = "a write to the storage is repeated until it succeeds";
                return Err(StoreError::away(fault, reason).into());
            }
            let written = self.try_write(place).await;
            self.observe_storage(place, &written);
            written?;
        }
        Ok(())
    }

    /// Tests the disk, so that a service that starts on a full disk reports it before a submission fails.
    pub(crate) async fn probe_disk(&self) {
        for place in [StoragePlace::Table, StoragePlace::Spool] {
            let written = self.try_write(place).await;
            self.observe_storage(place, &written);
        }
    }

    /// Writes to a location and removes what was written.
    async fn try_write(&self, place: StoragePlace) -> Result<()> {
        match place {
            StoragePlace::Table => Ok(self.store.ready(true).await?),
            StoragePlace::Results => {
                // No result there is smaller.
                let bytes = self.options.small_result_max_bytes;
                self.blobs.try_write(bytes).await
            }
            StoragePlace::Spool => {
                let folder = self.options.data_dir.clone();
                let failed = JobsError::at(&folder);
                let written = blocking(move || data_dir::try_write(&folder)).await?;
                written.map_err(failed)
            }
        }
    }
}
