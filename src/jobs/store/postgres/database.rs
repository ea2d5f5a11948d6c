//! The shared job table in PostgreSQL.

use std::fmt;

use sqlx::postgres::{PgConnectOptions, PgPool};

use crate::error::JobsError;
use crate::store::postgres::claim_memory::ClaimMemory;
use crate::store::postgres::connection::{connect, session};
use crate::store::postgres::notifier::Notifier;
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
