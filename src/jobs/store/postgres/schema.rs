//! The schema of the shared job table: made and brought forward by a command of the operator, required by every node.
//!
//! `schema.sql` is its first form. Every later one is a step of its own, so that a database in use is brought forward; a step is one
//! transaction. Nodes of the version before go on beside newer tables as long as a step leaves what they use: it says from which
//! form on programs can do so. What such a step leaves behind is removed by a step of the next version.

use sqlx::PgConnection;
use sqlx::postgres::PgPool;
use sqlx::{query, query_scalar};

use crate::error::JobsError;
use crate::store::postgres::connection::{self, connect, lock};

/// The statements that make an empty schema a job table of form 1.
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

/// The form that is read and written.
const SCHEMA_VERSION: i64 = STEPS[STEPS.len() - 1].0;

/// The form without a step.
const FIRST_SCHEMA_VERSION: i64 = 1;

/// What [`migrate`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Migrated {
    /// The tables were made.
    Made,
    /// They were there, in an earlier form.
    Upgraded,
    /// They were there.
    AlreadyCurrent,
}

/// Makes the tables in the first schema of the search path, or brings them forward to the form of this program. Several may do so
/// at once.
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
    // What is done to a large table takes its time.
    sqlx::raw_sql("SET LOCAL statement_timeout = 0")
        .execute(&mut *transaction)
        .await?;
    // Ends with the transaction: a lock of the session would not pass a pooler.
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

/// The form of the tables, if there are any.
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
