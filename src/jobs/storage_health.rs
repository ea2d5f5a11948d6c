//! Jobs while a disk is full or cannot be written: nothing that was accepted is lost, and the service says that it is not ready.
//!
//! A result that cannot be stored stays in memory; its worker waits and repeats the write.
//!
//! Each [`StoragePlace`] fails by itself. Its fault ends with the next write there that succeeds. While a writer waits, only its own
//! write ends the fault: smaller ones may find room on a disk that is full for it.

use std::future::Future;
use std::time::Duration;

use crate::disk_reserve;
use crate::error::{JobsError, Result, StorageFault, StoreError};
use crate::handle::Jobs;
use crate::shared::Shared;
use crate::storage_fault::{FaultChange, StoragePlace};
use crate::sync::blocking;

/// Tries to write where the cause is not the disk, with pauses that double from [`FIRST_PAUSE`].
const WRITE_TRIES: u32 = 6;

const FIRST_PAUSE: Duration = Duration::from_millis(50);

/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

impl Jobs {
    /// Passes the outcome of a write to the job table on. After a fault of the storage the service is not ready until a write succeeds.
    pub(crate) fn observe_write<T, E: Into<JobsError>>(&self, written: Result<T, E>) -> Result<T> {
        let written = written.map_err(Into::into);
        self.shared.observe_storage(StoragePlace::Table, &written);
        written
    }

    /// The error of a file for a body that is being received.
    pub(crate) fn staging_failed(&self, source: std::io::Error) -> JobsError {
        let path = self.shared.options.data_dir.clone();
        let error = JobsError::DataDir { path, source };
        if let Some(fault) = error.storage_fault() {
            self.shared.note_fault(StoragePlace::Spool, Some(fault));
        }
        error
    }
}

impl Shared {
    /// Notes whether a place takes what is written.
    pub(crate) fn observe_storage<T>(&self, place: StoragePlace, written: &Result<T>) {
        match written {
            Ok(_) => self.note_fault(place, None),
            // Filling a batch reads its file too, whose faults are noted where they arise.
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

    /// Writes to a place, again and again: a few times if the database fails for a moment, for as long as it takes if the disk is
    /// full or cannot be written. Gives up when the service stops.
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

    /// The store does not answer in time.
    pub(crate) fn silent_store(&self) -> StoreError {
        match (StoreError::timed_out(), self.store.cluster()) {
            (StoreError::Away(_, cause), Some(_)) => {
                StoreError::Away(StorageFault::Unreachable, cause)
            }
            (error, _) => error,
        }
    }

    /// Do all places take data? Writes only to those that did not the last time.
    pub(crate) async fn require_storage(&self) -> Result<()> {
        for place in StoragePlace::ALL {
            let Some((fault, waited_for)) = self.storage.fault(place) else {
                continue;
            };
            if fault == StorageFault::Damaged {
                return Err(StoreError::damaged().into());
            }
            if waited_for {
                return Err(StoreError::waited_for(fault).into());
            }
            let written = self.try_write(place).await;
            self.observe_storage(place, &written);
            written?;
        }
        Ok(())
    }

    /// Writes to a place and leaves nothing there.
    async fn try_write(&self, place: StoragePlace) -> Result<()> {
        match place {
            StoragePlace::Table => Ok(self.store.ready(true).await?),
            StoragePlace::Results => {
                // No result there is smaller.
                let bytes = self.options.small_result_max_bytes;
                self.blobs.try_write(bytes).await
            }
            StoragePlace::Spool => {
                let path = self.options.data_dir.clone();
                let folder = path.clone();
                let written = blocking(move || disk_reserve::try_write(&folder)).await?;
                written.map_err(|source| JobsError::DataDir { path, source })
            }
        }
    }
}
