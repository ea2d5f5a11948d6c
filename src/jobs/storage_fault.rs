//! Faults of the storage, as opposed to faults of a job.

use std::error::Error;
use std::io;

use crate::jobs::error::JobsError;
use crate::jobs::store_error::StorageFault;

/// What a folder is called in errors.
const DISK: &str = "LocalFileSystem";

impl JobsError {
    /// The fault of the storage behind this error, if that is what it is.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            JobsError::Store(error) => error.storage_fault(),
            JobsError::DataDir { source, .. } => of_io(source),
            JobsError::Blobs(object_store::Error::NotFound { .. }) => None,
            JobsError::Blobs(error) => {
                let far =
                    !matches!(error, object_store::Error::Generic { store, .. } if *store == DISK);
                if far {
                    // Whatever it is, it is not about the job.
                    return Some(StorageFault::Unreachable);
                }
                let mut cause: Option<&(dyn Error + 'static)> = Some(error);
                while let Some(error) = cause {
                    if let Some(error) = error.downcast_ref::<io::Error>() {
                        return of_io(error).or(Some(StorageFault::Unwritable));
                    }
                    cause = error.source();
                }
                Some(StorageFault::Unwritable)
            }
            _ => None,
        }
    }
}

pub(crate) fn of_io(error: &io::Error) -> Option<StorageFault> {
    use io::ErrorKind::{
        FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull,
    };
    match error.kind() {
        StorageFull | QuotaExceeded => Some(StorageFault::Full),
        ReadOnlyFilesystem | PermissionDenied | FileTooLarge => Some(StorageFault::Unwritable),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(JobsError::NotFound.storage_fault(), None);
    }
}
