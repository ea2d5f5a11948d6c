//! The job table in PostgreSQL, opened.

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
    /// The connection on which notifications are received.
    pub(crate) listens_at: Option<PgConnectOptions>,
    pub(crate) writer: PgPool,
    pub(crate) readers: PgPool,
    pub(crate) group_commit: GroupCommit,
    pub(crate) notifier: Notifier,
    pub(crate) claim_memory: ClaimMemory,
    /// Leases are judged by the times that are given, not by the clock of the database.
    pub(crate) given_clock: bool,
}

impl fmt::Debug for PostgresStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The options of a pool have a password in them.
        write!(f, "PostgresStore({} connections)", self.writer.size())
    }
}

impl PostgresStore {
    /// Opens the database, whose tables must be there, with at most so many connections beside two for wake-ups.
    ///
    /// # Errors
    /// [`JobsError::BadDatabaseUrl`], [`JobsError::UnsupportedSchema`], [`JobsError::NotMigrated`], or it cannot be reached.
    pub async fn open(url: &str, connections: u32) -> Result<PostgresStore, JobsError> {
        let (options, writer) = connect(url, connections).await?;
        require(&writer).await?;
        let store = PostgresStore {
            group_commit: GroupCommit::start(writer.clone()),
            notifier: Notifier::start(writer.clone()),
            claim_memory: ClaimMemory::default(),
            readers: writer.clone(),
            listens_at: Some(options),
            writer,
            given_clock: false,
        };
        Ok(store)
    }

    /// Receives notifications by another connection, or not at all.
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

    /// The same with leases that are judged by the times that are given, so that tests need no clock.
    #[must_use]
    pub fn with_given_clock(self) -> PostgresStore {
        PostgresStore {
            given_clock: true,
            ..self
        }
    }
}
