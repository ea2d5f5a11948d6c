//! The schema of the shared job table: created and migrated by `railhead migrate`, required by every node.
//!
//! `schema.sql` is version 1. Every later version is a migration, which is one transaction and can run while the database
//! is in use. Nodes of the previous version can continue with the new tables as long as a migration keeps what they use:
//! each migration names the oldest version that can use the tables. Leftovers are removed by a migration of the next
//! version.

use sqlx::PgConnection;
use sqlx::postgres::PgPool;
use sqlx::{query, query_scalar};

use crate::error::JobsError;
use crate::store::postgres::connection::{self, connect, lock};

/// The statements that create the tables of version 1.
const SCHEMA: &str = include_str!("schema.sql");

/// Migrations, in order: the version after the migration, its statements, and the oldest version whose programs can still use the tables.
/// A released migration is never changed.
const STEPS: &[(i64, &str, i64)] = &[
    (2, include_str!("steps/2.sql"), 2),
    // Earlier programs ignore labels, so that a key bound to some of them could read everything.
    (3, include_str!("steps/3.sql"), 3),
    // Adds a table that earlier programs do not use.
    (4, include_str!("steps/4.sql"), 3),
    // Earlier programs read templates from a table that this migration drops.
    (5, include_str!("steps/5.sql"), 5),
    // Earlier programs read runs from a tenant that no longer holds them.
    (6, include_str!("steps/6.sql"), 6),
    // Earlier programs cannot read the kind of an evolution.
    (7, include_str!("steps/7.sql"), 7),
    // Adds an index.
    (8, include_str!("steps/8.sql"), 7),
];

/// The version that this program reads and writes.
const SCHEMA_VERSION: i64 = STEPS[STEPS.len() - 1].0;

/// The version of `schema.sql`.
const FIRST_SCHEMA_VERSION: i64 = 1;

/// Result of [`migrate`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Migrated {
    /// The tables were created.
    Made,
    /// The tables were upgraded.
    Upgraded,
    /// The tables have this version or a later compatible one.
    AlreadyCurrent,
}

/// Creates the tables in the first schema of the search path, or migrates them to the version of this program. Concurrent
/// calls are safe.
///
/// # Errors
/// [`JobsError::UnsupportedSchema`] if there are tables that this program cannot use, or the database failed.
pub async fn migrate(url: &str) -> Result<Migrated, JobsError> {
    let (_, pool) = connect(url, 1).await?;
    let made = make(&pool).await;
    pool.close().await;
    made
}

async fn make(pool: &PgPool) -> Result<Migrated, JobsError> {
    let mut transaction = pool.begin().await?;
    // Changes of a large table may take long.
    sqlx::raw_sql("SET LOCAL statement_timeout = 0")
        .execute(&mut *transaction)
        .await?;
    // The lock ends with the transaction, because a session lock would not work with a pooler.
    lock(&mut transaction, connection::SCHEMA).await?;
    let before = form(&mut transaction).await?;
    if before.is_some_and(|form| form >= SCHEMA_VERSION) {
        require_within(&mut transaction).await?;
        return Ok(Migrated::AlreadyCurrent);
    }
    if before.is_none() {
        sqlx::raw_sql(SCHEMA).execute(&mut *transaction).await?;
        sql!(execute, &mut *transaction,
            "INSERT INTO deployment (one, form) VALUES (1, $1)";
            FIRST_SCHEMA_VERSION
        )?;
    }
    let reached = before.unwrap_or(FIRST_SCHEMA_VERSION);
    for (form, statements, readable_from) in STEPS.iter().filter(|step| step.0 > reached) {
        sqlx::raw_sql(*statements)
            .execute(&mut *transaction)
            .await?;
        sql!(execute, &mut *transaction,
            "UPDATE deployment SET form = $1, readable_from = $2";
            form, readable_from
        )?;
    }
    transaction.commit().await?;
    Ok(match before {
        None => Migrated::Made,
        Some(_) => Migrated::Upgraded,
    })
}

/// Requires tables that this program can use; changes nothing.
///
/// # Errors
/// [`JobsError::NotMigrated`], [`JobsError::OldTables`], [`JobsError::UnsupportedSchema`], or the database failed.
pub(crate) async fn require(pool: &PgPool) -> Result<(), JobsError> {
    let mut connection = pool.acquire().await?;
    require_within(&mut connection).await
}

async fn require_within(connection: &mut PgConnection) -> Result<(), JobsError> {
    let Some(form) = form(&mut *connection).await? else {
        return Err(JobsError::NotMigrated);
    };
    if form < SCHEMA_VERSION {
        return Err(JobsError::OldTables);
    }
    let readable_from: i64 = sql!(scalar fetch_one, connection,
        "SELECT readable_from FROM deployment"
    )?;
    match readable_from <= SCHEMA_VERSION {
        true => Ok(()),
        false => Err(JobsError::UnsupportedSchema),
    }
}

/// The version of the tables, if they exist.
async fn form(connection: &mut PgConnection) -> Result<Option<i64>, JobsError> {
    let there: bool = sql!(scalar fetch_one, &mut *connection,
        "SELECT to_regclass('deployment') IS NOT NULL"
    )?;
    if !there {
        return Ok(None);
    }
    let form = sqlx::query_scalar("SELECT form FROM deployment");
    Ok(form.fetch_optional(connection).await?)
}
