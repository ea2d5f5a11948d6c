//! Behaviour while storage is full or cannot be written: nothing that was accepted is lost, and the service is not ready.
//!
//! A result that cannot be stored stays in memory while its worker repeats the write.
//!
//! Each [`StoragePlace`] fails separately. Its fault ends with the next successful write there. While a writer repeats its
//! write, only that write ends the fault, because smaller ones may still find room.

use std::error::Error;
use std::future::Future;
use std::io;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use crate::data_dir;
use crate::error::{JobsError, Result, StorageFault, StoreError};
use crate::handle::Jobs;
use crate::shared::Shared;
use crate::sync::{blocking, lock};

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

/// Name of the local store in errors of `object_store`.
const DISK: &str = "LocalFileSystem";

impl JobsError {
    /// The fault of the storage that caused this error, if it is one.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            JobsError::Store(error) => error.storage_fault(),
            JobsError::DataDir { source, .. } => fault_of_io(source),
            JobsError::Blobs(object_store::Error::NotFound { .. }) => None,
            JobsError::Blobs(error) => {
                let far =
                    !matches!(error, object_store::Error::Generic { store, .. } if *store == DISK);
                if far {
                    // Any error of a remote store concerns the store, not the job.
                    return Some(StorageFault::Unreachable);
                }
                let mut cause: Option<&(dyn Error + 'static)> = Some(error);
                while let Some(error) = cause {
                    if let Some(error) = error.downcast_ref::<io::Error>() {
                        return fault_of_io(error).or(Some(StorageFault::Unwritable));
                    }
                    cause = error.source();
                }
                Some(StorageFault::Unwritable)
            }
            _ => None,
        }
    }
}

pub(crate) fn fault_of_io(error: &io::Error) -> Option<StorageFault> {
    use io::ErrorKind::{
        FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull,
    };
    match error.kind() {
        StorageFull | QuotaExceeded => Some(StorageFault::Full),
        ReadOnlyFilesystem | PermissionDenied | FileTooLarge => Some(StorageFault::Unwritable),
        _ => None,
    }
}

/// A location that the service writes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StoragePlace {
    /// The job table.
    Table,
    /// Results outside the table.
    Results,
    /// Spool files of request bodies.
    Spool,
}

impl StoragePlace {
    /// All locations.
    pub(crate) const ALL: [StoragePlace; 3] = [
        StoragePlace::Table,
        StoragePlace::Results,
        StoragePlace::Spool,
    ];
}

/// Current fault of each location.
#[derive(Debug, Default)]
pub(crate) struct StorageFaults(Mutex<[PlaceState; StoragePlace::ALL.len()]>);

#[derive(Debug, Clone, Copy, Default)]
struct PlaceState {
    fault: Option<StorageFault>,
    /// Number of writers that repeat their write until it succeeds.
    waiting: usize,
}

/// Effect of the outcome of a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FaultChange {
    /// The location fails from now on.
    Begun,
    /// No location fails any more.
    AllOver,
    /// No change.
    None,
}

/// Counts a writer that repeats its write, until it is dropped.
#[derive(Debug)]
pub(crate) struct WaitingWriter<'a>(&'a StorageFaults, StoragePlace);

impl StorageFaults {
    /// Records the outcome of a write. Damage remains until the next start, which checks the whole table.
    pub(crate) fn note(&self, place: StoragePlace, fault: Option<StorageFault>) -> FaultChange {
        let mut places = self.places();
        let fails = |places: &[PlaceState]| places.iter().any(|state| state.fault.is_some());
        let before = fails(&*places);
        let state = &mut places[place as usize];
        let begun = state.fault.is_none() && fault.is_some();
        let stays =
            state.fault == Some(StorageFault::Damaged) || (fault.is_none() && state.waiting > 0);
        if !stays {
            state.fault = fault;
        }
        match begun {
            true => FaultChange::Begun,
            false if before && !fails(&*places) => FaultChange::AllOver,
            false => FaultChange::None,
        }
    }

    /// The fault of a location, and whether a writer repeats its write there.
    pub(crate) fn fault(&self, place: StoragePlace) -> Option<(StorageFault, bool)> {
        let state = self.places()[place as usize];
        state.fault.map(|fault| (fault, state.waiting > 0))
    }

    /// Whether any location fails.
    pub(crate) fn any(&self) -> bool {
        self.places().iter().any(|state| state.fault.is_some())
    }

    /// Whether the table is damaged.
    pub(crate) fn damaged(&self) -> bool {
        let fault = self.fault(StoragePlace::Table);
        fault.is_some_and(|(fault, _)| fault == StorageFault::Damaged)
    }

    /// Counts a writer that repeats its write to a location.
    pub(crate) fn wait(&self, place: StoragePlace) -> WaitingWriter<'_> {
        self.places()[place as usize].waiting += 1;
        WaitingWriter(self, place)
    }

    fn places(&self) -> MutexGuard<'_, [PlaceState; StoragePlace::ALL.len()]> {
        lock(&self.0)
    }
}

impl Drop for WaitingWriter<'_> {
    fn drop(&mut self) {
        self.0.places()[self.1 as usize].waiting -= 1;
    }
}

#[cfg(test)]
mod storage_fault_tests {
    use super::*;
    use crate::model::Kind;

    #[test]
    fn places_fail_and_recover_one_by_one() {
        let faults = StorageFaults::default();
        let full = Some(StorageFault::Full);
        assert_eq!(faults.note(StoragePlace::Results, full), FaultChange::Begun);
        assert_eq!(faults.note(StoragePlace::Results, full), FaultChange::None);
        // A write to another place says nothing about this one.
        assert_eq!(faults.note(StoragePlace::Table, None), FaultChange::None);
        assert!(faults.any());
        let waiting = faults.wait(StoragePlace::Results);
        faults.note(StoragePlace::Results, None);
        assert_eq!(
            faults.fault(StoragePlace::Results),
            Some((StorageFault::Full, true)),
            "a smaller write does not end what a writer waits for"
        );
        drop(waiting);
        assert_eq!(
            faults.note(StoragePlace::Results, None),
            FaultChange::AllOver
        );
        assert!(!faults.any());
    }

    #[test]
    fn damage_stays() {
        let faults = StorageFaults::default();
        faults.note(StoragePlace::Table, Some(StorageFault::Damaged));
        faults.note(StoragePlace::Table, Some(StorageFault::Full));
        faults.note(StoragePlace::Table, None);
        assert!(faults.damaged() && faults.any());
    }

    #[test]
    fn wrapped_causes_are_recognised() {
        let wrapped = JobsError::Blobs(object_store::Error::Generic {
            store: DISK,
            source: Box::new(io::Error::from(io::ErrorKind::StorageFull)),
        });
        assert_eq!(wrapped.storage_fault(), Some(StorageFault::Full));
        let away = JobsError::Blobs(object_store::Error::Generic {
            store: DISK,
            source: Box::new(io::Error::from(io::ErrorKind::NotADirectory)),
        });
        assert_eq!(away.storage_fault(), Some(StorageFault::Unwritable));
        let server = JobsError::Blobs(object_store::Error::Generic {
            store: "S3",
            source: Box::new(io::Error::from(io::ErrorKind::ConnectionRefused)),
        });
        assert_eq!(server.storage_fault(), Some(StorageFault::Unreachable));
        let gone = JobsError::Blobs(object_store::Error::NotFound {
            path: "a key".to_owned(),
            source: Box::new(io::Error::from(io::ErrorKind::NotFound)),
        });
        assert_eq!(gone.storage_fault(), None);
        assert_eq!(JobsError::NotFound(Kind::Case).storage_fault(), None);
    }
}
