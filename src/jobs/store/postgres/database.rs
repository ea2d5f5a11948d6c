//! The shared job table in PostgreSQL: its URL, connections and advisory locks.
//!
//! Database URLs are interpreted as by libpq. Parameters that would be ignored are rejected. `sslmode` has the meaning of libpq (PostgreSQL
//! 15, 34.19.1): `require` encrypts, `verify-ca` also checks the signature of the server's certificate, `verify-full` also its name. Where
//! libpq trusts the authorities of one file, this service also trusts those of the system; without `sslrootcert` it trusts only those.

use std::fmt;
use std::io::ErrorKind;
use std::str::FromStr;
use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgConnection, PgPool, PgPoolOptions, PgSslMode};
use sqlx::{Connection, query};
use tokio::time::timeout;

use crate::error::{JobsError, StorageFault, StoreError};
use crate::store::postgres::claim_memory::ClaimMemory;
use crate::store::postgres::cluster::Notifier;
use crate::store::postgres::schema::require;
use crate::store::postgres::sql::submit::GroupCommit;
use crate::store::{NotifyMode, Result};

/// The job table that several processes share.
#[derive(Clone)]
pub struct PostgresStore {
    /// Options of the connection that receives notifications; `None`: no notifications.
    pub(crate) listens_at: Option<PgConnectOptions>,
    pub(crate) writer: PgPool,
    pub(crate) readers: PgPool,
    pub(crate) group_commit: GroupCommit,
    pub(crate) notifier: Notifier,
    pub(crate) claim_memory: ClaimMemory,
    /// Whether leases use the times of the arguments instead of the clock of the database, for tests.
    pub(crate) given_clock: bool,
}

impl fmt::Debug for PostgresStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The options of a pool contain a password.
        write!(f, "PostgresStore({} connections)", self.writer.size())
    }
}

impl PostgresStore {
    /// Opens the database, whose tables must exist, with a maximum number of connections, in addition to two for notifications.
    ///
    /// # Errors
    /// [`JobsError::BadDatabaseUrl`], [`JobsError::UnsupportedSchema`], [`JobsError::NotMigrated`], or it cannot be reached.
    pub async fn open(url: &str, connections: u32) -> Result<PostgresStore, JobsError> {
        let (options, writer) = connect(url, connections).await?;
        require(&writer).await?;
        let store = PostgresStore {
            group_commit: GroupCommit::start(writer.clone())?,
            notifier: Notifier::start(writer.clone()),
            claim_memory: ClaimMemory::default(),
            readers: writer.clone(),
            listens_at: Some(options),
            writer,
            given_clock: false,
        };
        Ok(store)
    }

    /// Sets the source of notifications.
    ///
    /// # Errors
    /// [`JobsError::BadDatabaseUrl`].
    pub fn with_notify_mode(self, mode: &NotifyMode) -> Result<PostgresStore, JobsError> {
        let listens_at = match mode {
            NotifyMode::Database => return Ok(self),
            NotifyMode::Direct(url) => Some(session(url)?),
            NotifyMode::Off => None,
        };
        Ok(PostgresStore { listens_at, ..self })
    }

    /// Uses the times of the arguments for leases, so that tests need no clock.
    #[must_use]
    pub fn with_given_clock(self) -> PostgresStore {
        PostgresStore {
            given_clock: true,
            ..self
        }
    }
}

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
    let options = read_url(url)?.application_name("railhead");
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

/// Supported parameters, in addition to `options[…]`.
const KNOWN: [&str; 12] = [
    "sslmode",
    "sslrootcert",
    "sslcert",
    "sslkey",
    "host",
    "hostaddr",
    "port",
    "dbname",
    "user",
    "password",
    "application_name",
    "options",
];

/// Ignored parameters: they request the default behaviour.
const HARMLESS: [(&str, &str); 3] = [
    ("connect_timeout", ""),
    ("gssencmode", "disable"),
    ("channel_binding", "prefer"),
];

/// Parses the URL of a database.
///
/// # Errors
/// [`JobsError::BadDatabaseUrl`] if it is invalid or has an unsupported parameter.
pub(crate) fn read_url(text: &str) -> Result<PgConnectOptions, JobsError> {
    let bad = |why: &str| JobsError::BadDatabaseUrl(why.to_owned());
    let (front, query) = text.split_once('?').unwrap_or((text, ""));
    let mut kept = Vec::new();
    let (mut system_roots, mut own_roots) = (false, false);
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        let harmless = HARMLESS
            .iter()
            .any(|(name, only)| *name == key && (only.is_empty() || *only == value));
        match (key, value) {
            ("sslrootcert", "system") => system_roots = true,
            _ if harmless => {}
            _ if KNOWN.contains(&key) || key.starts_with("options[") => kept.push(pair),
            _ => return Err(bad(&format!("`{pair}` is not supported"))),
        }
        own_roots |= key == "sslrootcert" && value != "system";
    }
    let kept = match kept.is_empty() {
        true => front.to_owned(),
        false => format!("{front}?{}", kept.join("&")),
    };
    let options = PgConnectOptions::from_str(&kept).map_err(|error| bad(&error.to_string()))?;
    match options.get_ssl_mode() {
        PgSslMode::Allow => Err(bad(
            "sslmode=allow is not supported: use disable, prefer, require, verify-ca or verify-full",
        )),
        PgSslMode::VerifyFull => Ok(options),
        _ if system_roots => Err(bad(
            "sslrootcert=system needs sslmode=verify-full, for anybody may have a certificate of a public authority",
        )),
        // As in libpq: a named authority implies that the certificate is checked.
        PgSslMode::Require if own_roots => Ok(options.ssl_mode(PgSslMode::VerifyCa)),
        _ => Ok(options),
    }
}

#[cfg(test)]
mod url_tests {
    use super::*;

    fn said(query: &str) -> String {
        match read_url(&format!("postgres://u:hush@h/d?{query}")) {
            Ok(options) => format!("{:?}", options.get_ssl_mode()),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_mode_means_what_it_means_in_libpq() {
        assert_eq!(said(""), "Prefer");
        assert_eq!(said("sslmode=require&connect_timeout=3"), "Require");
        assert_eq!(said("sslmode=require&sslrootcert=/ca.pem"), "VerifyCa");
        assert_eq!(said("sslmode=verify-full&sslrootcert=system"), "VerifyFull");
    }

    #[test]
    fn what_is_not_done_is_refused_and_not_left_out() {
        for (query, word) in [
            ("sslmode=allow", "sslmode=allow"),
            ("sslmode=require&sslrootcert=system", "verify-full"),
            ("sslcrl=/crl.pem", "sslcrl"),
            ("channel_binding=require", "channel_binding"),
            ("gssencmode=require", "gssencmode"),
            (
                "target_session_attrs=read_url-write",
                "target_session_attrs",
            ),
            ("sslmode=strict", "strict"),
        ] {
            let said = said(query);
            assert!(
                said.contains(word) && said.contains("postgres://"),
                "{said}"
            );
            assert!(!said.contains("hush"), "{said}");
        }
    }
}
