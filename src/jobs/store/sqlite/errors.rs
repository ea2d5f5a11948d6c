//! Errors of SQLite as those of a store.

use std::sync::Arc;

use crate::jobs::error::JobsError;
use crate::jobs::storage_fault::of_io;
use crate::jobs::store::error::{StorageFault, StoreError};

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        let fault = match &error {
            sqlx::Error::Database(cause) => cause.code().and_then(|code| of_code(&code)),
            sqlx::Error::PoolTimedOut => Some(StorageFault::Unwritable),
            sqlx::Error::Io(source) => of_io(source),
            _ => None,
        };
        match fault {
            Some(fault) => StoreError::Away(fault, Arc::new(error)),
            None => StoreError::Failed(Arc::new(error)),
        }
    }
}

impl From<sqlx::Error> for JobsError {
    fn from(error: sqlx::Error) -> Self {
        StoreError::from(error).into()
    }
}

/// The low byte of a code of SQLite is its kind.
fn of_code(code: &str) -> Option<StorageFault> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extended_codes_are_recognised() {
        assert_eq!(of_code("13"), Some(StorageFault::Full));
        // SQLITE_IOERR_WRITE, SQLITE_READONLY_DBMOVED.
        assert_eq!(of_code("778"), Some(StorageFault::Unwritable));
        assert_eq!(of_code("1032"), Some(StorageFault::Unwritable));
        // SQLITE_CORRUPT_INDEX, SQLITE_NOTADB.
        assert_eq!(of_code("779"), Some(StorageFault::Unwritable));
        assert_eq!(of_code("26"), Some(StorageFault::Unwritable));
        // SQLITE_CONSTRAINT_PRIMARYKEY.
        assert_eq!(of_code("1555"), None);
    }
}
