//! What becomes of jobs while the disk is full or cannot be written: nothing new is accepted, nothing accepted is lost.
//!
//! A result that cannot be stored stays in memory, its worker waits with it and tries again.

use std::error::Error;
use std::future::Future;
use std::io;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::jobs::error::JobsError;
use crate::jobs::{Jobs, Shared};

/// Tries to write where the cause is not the disk, with pauses that double from [`FIRST_PAUSE`].
const WRITE_TRIES: u32 = 6;
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Longest pause between two tries.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

/// Why the disk takes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// No space is left, or a quota is used up.
    Full,
    /// It is read-only, it fails, the job table is damaged, or locked by another process, or the results cannot be reached.
    Unwritable,
}

impl JobsError {
    /// The trouble with the disk behind this error, if that is what it is.
    #[must_use]
    pub fn trouble(&self) -> Option<Trouble> {
        match self {
            JobsError::Database(sqlx::Error::Database(error)) => of_sqlite(error.code()?.as_ref()),
            JobsError::Database(sqlx::Error::PoolTimedOut) => Some(Trouble::Unwritable),
            JobsError::Database(sqlx::Error::Io(source)) | JobsError::DataDir { source, .. } => {
                of_io(source)
            }
            JobsError::Together(error) => error.trouble(),
            JobsError::Results(object_store::Error::NotFound { .. }) => None,
            JobsError::Results(error) => {
                let mut cause: Option<&(dyn Error + 'static)> = Some(error);
                while let Some(error) = cause {
                    if let Some(error) = error.downcast_ref::<io::Error>() {
                        return of_io(error).or(Some(Trouble::Unwritable));
                    }
                    cause = error.source();
                }
                // Whatever it is, it is not about the job.
                Some(Trouble::Unwritable)
            }
            _ => None,
        }
    }
}

/// The low byte of a code of SQLite is its kind.
fn of_sqlite(code: &str) -> Option<Trouble> {
    const BUSY: u32 = 5;
    const LOCKED: u32 = 6;
    const READONLY: u32 = 8;
    const IOERR: u32 = 10;
    const FULL: u32 = 13;
    const CORRUPT: u32 = 11;
    const CANTOPEN: u32 = 14;
    const NOTADB: u32 = 26;
    match code.parse::<u32>().ok()? & 0xff {
        FULL => Some(Trouble::Full),
        BUSY | LOCKED | READONLY | IOERR | CORRUPT | CANTOPEN | NOTADB => Some(Trouble::Unwritable),
        _ => None,
    }
}

fn of_io(error: &io::Error) -> Option<Trouble> {
    use io::ErrorKind::{
        FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull,
    };
    match error.kind() {
        StorageFull | QuotaExceeded => Some(Trouble::Full),
        ReadOnlyFilesystem | PermissionDenied | FileTooLarge => Some(Trouble::Unwritable),
        _ => None,
    }
}

impl Jobs {
    /// Passes a failed submission on; trouble with the disk makes the service not ready until a write succeeds.
    pub(super) fn noted<T>(&self, written: Result<T, JobsError>) -> Result<T, JobsError> {
        self.shared.note(&written);
        written
    }
}

impl Shared {
    /// Remembers whether the disk takes what is written.
    pub(super) fn note<T>(&self, written: &Result<T, JobsError>) {
        let trouble = match written {
            Ok(_) => None,
            Err(error) => match error.trouble() {
                Some(trouble) => Some(trouble),
                // It was not about the disk.
                None => return,
            },
        };
        let before = self
            .storage_failing
            .swap(trouble.is_some(), Ordering::Relaxed);
        self.metrics.storage_failing(trouble.is_some());
        match trouble {
            Some(trouble) if !before => tracing::error!(?trouble, "the disk takes nothing"),
            None if before => tracing::info!("the disk takes data again"),
            _ => {}
        }
    }

    /// Writes, again and again: a few times if the database fails for a moment, for as long as it takes if the disk is
    /// full or cannot be written. Gives up when the service stops.
    pub(super) async fn write_patiently<T, F>(
        &self,
        mut write: impl FnMut() -> F,
    ) -> Result<T, JobsError>
    where
        F: Future<Output = Result<T, JobsError>>,
    {
        let (mut pause, mut tries) = (FIRST_PAUSE, 1);
        loop {
            let written = write().await;
            self.note(&written);
            let Err(error) = &written else { return written };
            let waits = error.trouble().is_some() && !self.stopping.is_cancelled();
            let again = matches!(error, JobsError::Database(_)) && tries < WRITE_TRIES;
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

    /// Does the disk take data? Writes only if it did not the last time.
    pub(super) async fn require_storage(&self) -> Result<(), JobsError> {
        if !self.storage_failing.load(Ordering::Relaxed) {
            return Ok(());
        }
        let written = self.store.touch().await;
        self.note(&written);
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extended_codes_and_wrapped_causes_are_recognised() {
        assert_eq!(of_sqlite("13"), Some(Trouble::Full));
        // SQLITE_IOERR_WRITE, SQLITE_READONLY_DBMOVED.
        assert_eq!(of_sqlite("778"), Some(Trouble::Unwritable));
        assert_eq!(of_sqlite("1032"), Some(Trouble::Unwritable));
        // SQLITE_CORRUPT_INDEX, SQLITE_NOTADB.
        assert_eq!(of_sqlite("779"), Some(Trouble::Unwritable));
        assert_eq!(of_sqlite("26"), Some(Trouble::Unwritable));
        // SQLITE_CONSTRAINT_PRIMARYKEY.
        assert_eq!(of_sqlite("1555"), None);
        let wrapped = JobsError::Results(object_store::Error::Generic {
            store: "a test",
            source: Box::new(io::Error::from(io::ErrorKind::StorageFull)),
        });
        assert_eq!(wrapped.trouble(), Some(Trouble::Full));
        let away = JobsError::Results(object_store::Error::Generic {
            store: "a test",
            source: Box::new(io::Error::from(io::ErrorKind::NotADirectory)),
        });
        assert_eq!(away.trouble(), Some(Trouble::Unwritable));
        let gone = JobsError::Results(object_store::Error::NotFound {
            path: "a key".to_owned(),
            source: Box::new(io::Error::from(io::ErrorKind::NotFound)),
        });
        assert_eq!(gone.trouble(), None);
        assert_eq!(JobsError::NotFound.trouble(), None);
    }
}
