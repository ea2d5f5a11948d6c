//! Connections to PostgreSQL, and the locks that nodes take there.

use std::io::ErrorKind;
use std::time::Duration;

use sqlx::Connection;
use sqlx::postgres::{PgConnectOptions, PgConnection, PgPool, PgPoolOptions};
use sqlx::query;
use tokio::time::timeout;

use crate::error::{JobsError, StoreError};
use crate::store::Result;
use crate::store::postgres::url;

/// How long a call waits for a connection.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);

/// Prepared statements kept by a connection. Statements on several rows have a text for each number of rows.
const STATEMENTS_KEPT: usize = 300;

/// How long a connection may take to say that it is alive, before it is used and before it is kept for later.
const ALIVE_WITHIN: Duration = Duration::from_secs(3);

/// A connection that was used so lately is not asked.
const ALIVE_FOR: Duration = Duration::from_secs(1);

/// Settings of every session. A node that was cut off inside a transaction keeps its rows locked, and others pass them by,
/// until the server ends the session: because nothing is asked in the transaction, or because nobody takes what it sends.
const SESSION: [(&str, &str); 7] = [
    ("statement_timeout", "10s"),
    ("lock_timeout", "5s"),
    ("idle_in_transaction_session_timeout", "3s"),
    ("tcp_keepalives_idle", "10"),
    ("tcp_keepalives_interval", "5"),
    ("tcp_keepalives_count", "3"),
    ("tcp_user_timeout", "10s"),
];

/// Locks of this service are told from those of others in the same database by this number ("rhjb"); the second number says
/// what is locked.
pub(crate) const LOCKS: i32 = 0x7268_6a62;
pub(crate) const ADMISSION: i32 = 1;
pub(crate) const FOLD: i32 = 2;
pub(crate) const SCHEMA: i32 = 3;

/// How sessions with a database begin.
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

/// Connects to a database, whatever is in it.
///
/// # Errors
/// [`JobsError::BadDatabaseUrl`], [`JobsError::NoTls`], or it cannot be reached.
pub(crate) async fn connect(
    url: &str,
    connections: u32,
) -> Result<(PgConnectOptions, PgPool), JobsError> {
    let options = session(url)?;
    // A pool tries again until its time is over, and then no longer knows why.
    let first = timeout(CONNECT_WITHIN, PgConnection::connect_with(&options)).await;
    let first = first.map_err(|_| StoreError::timed_out())?;
    first.map_err(tls_failed)?.close().await?;
    let pool = PgPoolOptions::new()
        .max_connections(connections)
        .acquire_timeout(CONNECT_WITHIN)
        // The questions of the pool itself have no end: on a way that swallows everything they would keep all connections for
        // as long as TCP tries, which is a quarter of an hour.
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

/// Asks the server for a sign of life; a transaction that was left is rolled back with it.
async fn alive(connection: &mut PgConnection) -> Result<(), sqlx::Error> {
    let silent = |_| sqlx::Error::Io(ErrorKind::TimedOut.into());
    timeout(ALIVE_WITHIN, connection.ping())
        .await
        .map_err(silent)?
}

/// A connection that is not encrypted as the URL asks, or whose other end cannot be trusted, is no server that is away.
fn tls_failed(error: sqlx::Error) -> JobsError {
    match error {
        sqlx::Error::Tls(cause) => JobsError::NoTls(cause.to_string()),
        // What the handshake says of a certificate that it does not accept.
        sqlx::Error::Io(cause) if cause.kind() == ErrorKind::InvalidData => {
            JobsError::NoTls(cause.to_string())
        }
        other => other.into(),
    }
}

/// From here to the end of the transaction nobody else has this lock.
pub(crate) async fn lock(connection: &mut PgConnection, what: i32) -> Result<()> {
    sql!(execute, connection, "SELECT pg_advisory_xact_lock($1, $2)"; LOCKS, what)?;
    Ok(())
}
