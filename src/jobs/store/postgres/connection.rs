//! Connections to PostgreSQL, and advisory locks.

use std::io::ErrorKind;
use std::time::Duration;

use sqlx::Connection;
use sqlx::postgres::{PgConnectOptions, PgConnection, PgPool, PgPoolOptions};
use sqlx::query;
use tokio::time::timeout;

use crate::error::{JobsError, StorageFault, StoreError};
use crate::store::Result;
use crate::store::postgres::url;

/// How long a call waits for a connection.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);

/// Number of prepared statements that a connection caches. Statements on several rows have a different text for each number
/// of rows.
const STATEMENTS_KEPT: usize = 300;

/// Time limit of the check of a connection before its use and before it returns to the pool.
const ALIVE_WITHIN: Duration = Duration::from_secs(3);

/// A connection that was used within this time is not checked.
const ALIVE_FOR: Duration = Duration::from_secs(1);

/// Settings of every session. A node that was disconnected inside a transaction keeps its rows locked, and others skip
/// them, until the server ends the session because it is idle or its connection is dead.
const SESSION: [(&str, &str); 7] = [
    ("statement_timeout", "10s"),
    ("lock_timeout", "5s"),
    ("idle_in_transaction_session_timeout", "3s"),
    ("tcp_keepalives_idle", "10"),
    ("tcp_keepalives_interval", "5"),
    ("tcp_keepalives_count", "3"),
    ("tcp_user_timeout", "10s"),
];

/// The first number of all advisory locks of this service ("rhjb"); the second one identifies the lock.
pub(crate) const LOCKS: i32 = 0x7268_6a62;
pub(crate) const ADMISSION: i32 = 1;
pub(crate) const FOLD: i32 = 2;
pub(crate) const SCHEMA: i32 = 3;

/// The options of sessions with a database.
///
/// # Errors
/// [`JobsError::BadDatabaseUrl`].
pub(crate) fn session(url: &str) -> Result<PgConnectOptions, JobsError> {
    let options = url::read(url)?.application_name("railhead");
    Ok(options
        .statement_cache_capacity(STATEMENTS_KEPT)
        // The server's own setting loses no digit, and poolers refuse who begins with another one.
        .extra_float_digits(None)
        .options(SESSION))
}

/// Connects to a database with any contents.
///
/// # Errors
/// [`JobsError::BadDatabaseUrl`], [`JobsError::NoTls`], or it cannot be reached.
pub(crate) async fn connect(
    url: &str,
    connections: u32,
) -> Result<(PgConnectOptions, PgPool), JobsError> {
    let options = session(url)?;
    // The pool would retry until its time limit, and lose the cause.
    let first = timeout(CONNECT_WITHIN, PgConnection::connect_with(&options)).await;
    let first = first.map_err(|_| StoreError::timed_out())?;
    first.map_err(tls_failed)?.close().await?;
    let pool = PgPoolOptions::new()
        .max_connections(connections)
        .acquire_timeout(CONNECT_WITHIN)
        // The checks of the pool have no time limit: on a connection that drops packets they would block all connections
        // until TCP gives up after a quarter of an hour.
        .test_before_acquire(false)
        .before_acquire(|connection, used| {
            Box::pin(async move {
                match used.idle_for < ALIVE_FOR {
                    true => Ok(true),
                    false => alive(connection).await.map(|()| true),
                }
            })
        })
        .after_release(|connection, _| {
            Box::pin(async move { alive(connection).await.map(|()| true) })
        })
        .connect_with(options.clone())
        .await?;
    Ok((options, pool))
}

/// Checks a connection; rolls back a transaction that is still open.
async fn alive(connection: &mut PgConnection) -> Result<(), sqlx::Error> {
    let silent = |_| sqlx::Error::Io(ErrorKind::TimedOut.into());
    timeout(ALIVE_WITHIN, connection.ping())
        .await
        .map_err(silent)?
}

/// Classifies an encryption that does not meet the URL, or a server that is not trusted, which is not an unavailable server.
fn tls_failed(error: sqlx::Error) -> JobsError {
    match error {
        sqlx::Error::Tls(cause) => JobsError::NoTls(cause.to_string()),
        // The error of the handshake for a certificate that is not accepted.
        sqlx::Error::Io(cause) if cause.kind() == ErrorKind::InvalidData => {
            JobsError::NoTls(cause.to_string())
        }
        other => other.into(),
    }
}

/// Takes an advisory lock until the end of the transaction.
pub(crate) async fn lock(connection: &mut PgConnection, what: i32) -> Result<()> {
    sql!(execute, connection, "SELECT pg_advisory_xact_lock($1, $2)"; LOCKS, what)?;
    Ok(())
}

/// Maximum duration of a call; the server ends its statements earlier.
const ANSWERED_WITHIN: Duration = Duration::from_secs(15);

/// Runs a call with a time limit.
pub(crate) async fn in_time<T>(call: impl Future<Output = Result<T>>) -> Result<T> {
    let answer = timeout(ANSWERED_WITHIN, call).await;
    answer
        .unwrap_or_else(|_| Err(StoreError::timed_out()))
        .map_err(far)
}

/// Classifies a server that rejects writes as unreachable, as opposed to a local disk.
fn far(error: StoreError) -> StoreError {
    match error {
        StoreError::Away(StorageFault::Unwritable, cause) => {
            StoreError::Away(StorageFault::Unreachable, cause)
        }
        other => other,
    }
}
