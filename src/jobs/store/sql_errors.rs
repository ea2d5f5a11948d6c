//! Conversion of database errors to [`StoreError`].

#[cfg(feature = "cluster")]
use std::io::ErrorKind;
use std::sync::Arc;

use rusqlite::ErrorCode;

use crate::error::{StorageFault, StoreError};

#[cfg(feature = "cluster")]
use crate::error::JobsError;
#[cfg(feature = "cluster")]
use crate::storage_fault::fault_of_io;

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        match error.sqlite_error_code().and_then(fault_of_code) {
            Some(fault) => StoreError::Away(fault, Arc::new(error)),
            None => StoreError::Failed(Arc::new(error)),
        }
    }
}

fn fault_of_code(code: ErrorCode) -> Option<StorageFault> {
    match code {
        ErrorCode::DiskFull => Some(StorageFault::Full),
        ErrorCode::DatabaseBusy
        | ErrorCode::DatabaseLocked
        | ErrorCode::ReadOnly
        | ErrorCode::SystemIoFailure
        | ErrorCode::CannotOpen => Some(StorageFault::Unwritable),
        ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase => Some(StorageFault::Damaged),
        _ => None,
    }
}

#[cfg(feature = "cluster")]
impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        let fault = match &error {
            sqlx::Error::Database(cause) => cause.code().and_then(|code| of_state(&code)),
            sqlx::Error::PoolTimedOut | sqlx::Error::PoolClosed | sqlx::Error::Tls(_) => {
                Some(StorageFault::Unwritable)
            }
            sqlx::Error::Io(source) => fault_of_io(source).or_else(|| fault_of_connection(source)),
            _ => None,
        };
        match fault {
            Some(fault) => StoreError::Away(fault, Arc::new(error)),
            None => StoreError::Failed(Arc::new(error)),
        }
    }
}

#[cfg(feature = "cluster")]
impl From<sqlx::Error> for JobsError {
    fn from(error: sqlx::Error) -> Self {
        StoreError::from(error).into()
    }
}

/// The fault of a connection error, if the server is unavailable or unreachable.
#[cfg(feature = "cluster")]
fn fault_of_connection(error: &std::io::Error) -> Option<StorageFault> {
    match error.kind() {
        ErrorKind::ConnectionRefused
        | ErrorKind::ConnectionReset
        | ErrorKind::ConnectionAborted
        | ErrorKind::NotConnected
        | ErrorKind::BrokenPipe
        | ErrorKind::UnexpectedEof
        // A certificate that is no longer accepted.
        | ErrorKind::InvalidData
        | ErrorKind::TimedOut
        | ErrorKind::HostUnreachable
        | ErrorKind::NetworkUnreachable => Some(StorageFault::Unwritable),
        _ => None,
    }
}

/// The fault of a PostgreSQL error code (SQLSTATE), whose first two characters are the class.
#[cfg(feature = "cluster")]
fn of_state(state: &str) -> Option<StorageFault> {
    const DISK_FULL: &str = "53100";
    // Cancelled by `statement_timeout`, or timed out waiting for a lock.
    const TOO_SLOW: [&str; 2] = ["57014", "55P03"];
    // Read-only after a failover; a session that was ended because its transaction was idle.
    const ENDED: [&str; 2] = ["25006", "25P03"];
    match state {
        DISK_FULL => Some(StorageFault::Full),
        _ if TOO_SLOW.contains(&state) || ENDED.contains(&state) => Some(StorageFault::Unwritable),
        // Connection, resources, operator, system.
        _ if ["08", "53", "57", "58"].contains(&state.get(..2)?) => Some(StorageFault::Unwritable),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "cluster")]
    #[test]
    fn a_server_that_stops_is_away_and_a_full_one_is_full() {
        let away = Some(StorageFault::Unwritable);
        for state in ["57P01", "57P03", "08006", "25006", "53300", "55P03"] {
            assert_eq!(of_state(state), away, "{state}");
        }
        assert_eq!(of_state("53100"), Some(StorageFault::Full));
        // A key that is there already, a deadlock.
        assert_eq!(of_state("23505"), None);
        assert_eq!(of_state("40P01"), None);
    }

    #[test]
    fn extended_codes_are_recognised() {
        let fault_of = |code| {
            let error = rusqlite::ffi::Error::new(code);
            StoreError::from(rusqlite::Error::SqliteFailure(error, None)).storage_fault()
        };
        assert_eq!(fault_of(13), Some(StorageFault::Full));
        // SQLITE_IOERR_WRITE, SQLITE_READONLY_DBMOVED.
        assert_eq!(fault_of(778), Some(StorageFault::Unwritable));
        assert_eq!(fault_of(1032), Some(StorageFault::Unwritable));
        // SQLITE_CORRUPT_INDEX, SQLITE_NOTADB.
        assert_eq!(fault_of(779), Some(StorageFault::Damaged));
        assert_eq!(fault_of(26), Some(StorageFault::Damaged));
        // SQLITE_CONSTRAINT_PRIMARYKEY.
        assert_eq!(fault_of(1555), None);
    }
}
