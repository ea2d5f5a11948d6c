//! Faults of the storage, as opposed to failures of a job.

use std::error::Error;
use std::io;
use std::sync::Mutex;

use crate::error::{JobsError, StorageFault};
use crate::sync::lock;

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
        let mut places = lock(&self.0);
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
        let state = lock(&self.0)[place as usize];
        state.fault.map(|fault| (fault, state.waiting > 0))
    }

    /// Whether any location fails.
    pub(crate) fn any(&self) -> bool {
        lock(&self.0).iter().any(|state| state.fault.is_some())
    }

    /// Whether the table is damaged.
    pub(crate) fn damaged(&self) -> bool {
        let fault = self.fault(StoragePlace::Table);
        fault.is_some_and(|(fault, _)| fault == StorageFault::Damaged)
    }

    /// Counts a writer that repeats its write to a location.
    pub(crate) fn wait(&self, place: StoragePlace) -> WaitingWriter<'_> {
        lock(&self.0)[place as usize].waiting += 1;
        WaitingWriter(self, place)
    }
}

impl Drop for WaitingWriter<'_> {
    fn drop(&mut self) {
        lock(&self.0.0)[self.1 as usize].waiting -= 1;
    }
}

#[cfg(test)]
mod tests {
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
