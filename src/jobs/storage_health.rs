//! Jobs while the disk is full or cannot be written: nothing new is accepted, and nothing that was accepted is lost.
//!
//! A result that cannot be stored stays in memory, its worker waits with it and tries again.

use std::future::Future;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::shared::Shared;
use crate::jobs::store_error::{StorageFault, StoreError};

/// Tries to write where the cause is not the disk, with pauses that double from [`FIRST_PAUSE`].
const WRITE_TRIES: u32 = 6;

const FIRST_PAUSE: Duration = Duration::from_millis(50);

/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

impl Jobs {
    /// Passes the outcome of a write on. After a fault of the storage the service is not ready until a write succeeds.
    pub(crate) fn observe_write<T, E: Into<JobsError>>(
        &self,
        written: Result<T, E>,
    ) -> Result<T, JobsError> {
        let written = written.map_err(Into::into);
        self.shared.observe_storage(&written);
        written
    }
}

impl Shared {
    /// Remembers whether the disk takes what is written.
    pub(crate) fn observe_storage<T>(&self, written: &Result<T, JobsError>) {
        let trouble = match written {
            Ok(_) if self.storage_damaged.load(Ordering::Relaxed) => return,
            Ok(_) => None,
            Err(error) => match error.storage_fault() {
                Some(trouble) => Some(trouble),
                // It was not about the disk.
                None => return,
            },
        };
        if trouble == Some(StorageFault::Damaged) {
            self.storage_damaged.store(true, Ordering::Relaxed);
        }
        let before = self
            .storage_failing
            .swap(trouble.is_some(), Ordering::Relaxed);
        self.metrics.storage_failing(trouble.is_some());
        match trouble {
            Some(StorageFault::Unreachable) if !before => {
                tracing::error!("the database or the store of results cannot be reached");
            }
            Some(trouble) if !before => tracing::error!(?trouble, "the disk takes nothing"),
            None if before && self.store.cluster().is_some() => {
                tracing::info!("the database takes data again");
            }
            None if before => tracing::info!("the disk takes data again"),
            _ => {}
        }
    }

    /// Writes, again and again: a few times if the database fails for a moment, for as long as it takes if the disk is
    /// full or cannot be written. Gives up when the service stops.
    pub(crate) async fn write_with_retries<T, E, F>(
        &self,
        mut write: impl FnMut() -> F,
    ) -> Result<T, JobsError>
    where
        F: Future<Output = Result<T, E>>,
        E: Into<JobsError>,
    {
        let (mut pause, mut tries) = (FIRST_PAUSE, 1);
        loop {
            let written = write().await.map_err(Into::into);
            self.observe_storage(&written);
            let Err(error) = &written else { return written };
            let waits = error.storage_fault().is_some() && !self.stopping.is_cancelled();
            let again = matches!(error, JobsError::Store(_)) && tries < WRITE_TRIES;
            if !waits && !again {
                return written;
            }
            tracing::warn!(%error, "could not be written yet");
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

    /// Does the disk take data? Writes only if it did not the last time.
    pub(crate) async fn require_storage(&self) -> Result<(), JobsError> {
        if !self.storage_failing.load(Ordering::Relaxed) {
            return Ok(());
        }
        if self.storage_damaged.load(Ordering::Relaxed) {
            return Err(StoreError::damaged().into());
        }
        let written = self.store.ready(true).await.map_err(JobsError::from);
        self.observe_storage(&written);
        written
    }
}
