//! Faults of the storage, as opposed to faults of a job.

use std::error::Error;
use std::io;

use crate::jobs::error::JobsError;

/// Why the disk takes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageFault {
    /// No space is left, or a quota is used up.
    Full,
    /// It is read-only, it fails, the job table is damaged, or locked by another process, or the results cannot be reached.
    Unwritable,
}

impl JobsError {
    /// The trouble with the disk behind this error, if that is what it is.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            JobsError::Database(sqlx::Error::Database(error)) => of_sqlite(error.code()?.as_ref()),
            JobsError::Database(sqlx::Error::PoolTimedOut) => Some(StorageFault::Unwritable),
            JobsError::Database(sqlx::Error::Io(source)) | JobsError::DataDir { source, .. } => {
                of_io(source)
            }
            JobsError::Together(error) => error.storage_fault(),
            JobsError::Blobs(object_store::Error::NotFound { .. }) => None,
            JobsError::Blobs(error) => {
                let mut cause: Option<&(dyn Error + 'static)> = Some(error);
                while let Some(error) = cause {
                    if let Some(error) = error.downcast_ref::<io::Error>() {
                        return of_io(error).or(Some(StorageFault::Unwritable));
                    }
                    cause = error.source();
                }
                // Whatever it is, it is not about the job.
                Some(StorageFault::Unwritable)
            }
            _ => None,
        }
    }
}

/// The low byte of a code of SQLite is its kind.
fn of_sqlite(code: &str) -> Option<StorageFault> {
    const BUSY: u32 = 5;
    const LOCKED: u32 = 6;
    const READONLY: u32 = 8;
    const IOERR: u32 = 10;
    const FULL: u32 = 13;
    const CORRUPT: u32 = 11;
    const CANTOPEN: u32 = 14;
    const NOTADB: u32 = 26;
    match code.parse::<u32>().ok()? & 0xff {
        FULL => Some(StorageFault::Full),
        BUSY | LOCKED | READONLY | IOERR | CORRUPT | CANTOPEN | NOTADB => {
            Some(StorageFault::Unwritable)
        }
        _ => None,
    }
}

fn of_io(error: &io::Error) -> Option<StorageFault> {
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
    fn extended_codes_and_wrapped_causes_are_recognised() {
        assert_eq!(of_sqlite("13"), Some(StorageFault::Full));
        // SQLITE_IOERR_WRITE, SQLITE_READONLY_DBMOVED.
        assert_eq!(of_sqlite("778"), Some(StorageFault::Unwritable));
        assert_eq!(of_sqlite("1032"), Some(StorageFault::Unwritable));
        // SQLITE_CORRUPT_INDEX, SQLITE_NOTADB.
        assert_eq!(of_sqlite("779"), Some(StorageFault::Unwritable));
        assert_eq!(of_sqlite("26"), Some(StorageFault::Unwritable));
        // SQLITE_CONSTRAINT_PRIMARYKEY.
        assert_eq!(of_sqlite("1555"), None);
        let wrapped = JobsError::Blobs(object_store::Error::Generic {
            store: "a test",
            source: Box::new(io::Error::from(io::ErrorKind::StorageFull)),
        });
        assert_eq!(wrapped.storage_fault(), Some(StorageFault::Full));
        let away = JobsError::Blobs(object_store::Error::Generic {
            store: "a test",
            source: Box::new(io::Error::from(io::ErrorKind::NotADirectory)),
        });
        assert_eq!(away.storage_fault(), Some(StorageFault::Unwritable));
        let gone = JobsError::Blobs(object_store::Error::NotFound {
            path: "a key".to_owned(),
            source: Box::new(io::Error::from(io::ErrorKind::NotFound)),
        });
        assert_eq!(gone.storage_fault(), None);
        assert_eq!(JobsError::NotFound.storage_fault(), None);
    }
}
