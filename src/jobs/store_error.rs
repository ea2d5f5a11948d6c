//! Why a call of a store failed, sorted by what the caller can do. It stands before the stores, because every error of this room may carry one.

use std::error::Error;
use std::sync::Arc;

use thiserror::Error;

/// Why the storage takes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageFault {
    /// No space is left, or a quota is used up.
    Full,
    /// It is read-only, fails, or is locked by another process.
    Unwritable,
    /// Its contents are damaged; that does not pass by itself.
    Damaged,
    /// It is on another machine, and does not answer or takes nothing.
    Unreachable,
}

/// A call of a store failed and changed nothing. Clones share the cause.
#[derive(Debug, Clone, Error)]
pub enum StoreError {
    /// The storage takes nothing at present: wait and repeat the call. No job fails because of it.
    #[error("{1}")]
    Away(StorageFault, Arc<dyn Error + Send + Sync>),
    /// The call failed for another reason: a repetition may help, or the fault is ours.
    #[error("{0}")]
    Failed(Arc<dyn Error + Send + Sync>),
    /// What is stored cannot be read.
    #[error("stored data is damaged: {0}")]
    Corrupt(String),
}

impl StoreError {
    /// The fault of the storage, if that is what it is.
    #[must_use]
    pub fn storage_fault(&self) -> Option<StorageFault> {
        match self {
            StoreError::Away(fault, _) => Some(*fault),
            StoreError::Failed(_) | StoreError::Corrupt(_) => None,
        }
    }

    /// Damage was met before.
    #[must_use]
    pub fn damaged() -> StoreError {
        let cause = std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            "the job table is damaged; stop the service and restore a backup",
        );
        StoreError::Away(StorageFault::Damaged, Arc::new(cause))
    }

    /// A writer waits for the storage.
    #[must_use]
    pub fn waited_for(fault: StorageFault) -> StoreError {
        let cause = std::io::Error::other("a write to the storage is repeated until it succeeds");
        StoreError::Away(fault, Arc::new(cause))
    }

    /// The store did not answer in time.
    #[must_use]
    pub fn timed_out() -> StoreError {
        let cause = std::io::Error::from(std::io::ErrorKind::TimedOut);
        StoreError::Away(StorageFault::Unwritable, Arc::new(cause))
    }
}
