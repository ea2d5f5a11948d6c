//! The schema of the shared job table: made and brought forward by a command of the operator, required by every node.
//!
//! `schema.sql` is its first form. Every later one is a step of its own, so that a database in use is brought forward; a step is one
//! transaction. Nodes of the version before go on beside newer tables as long as a step leaves what they use: it says from which
//! form on programs can do so. What such a step leaves behind is removed by a step of the next version.

use sqlx::PgConnection;
use sqlx::postgres::PgPool;

use crate::jobs::error::JobsError;
use crate::jobs::store::postgres::connection::{self, connect, lock};

/// The statements that make an empty schema a job table of form 1.
const SCHEMA: &str = include_str!("schema.sql");

/// A change of the tables.
struct Step {
    /// The form that it leads to.
    form: i64,
    statements: &'static str,
    /// The oldest form whose programs can use the tables afterwards.
    readable_from: i64,
}

/// What is done to tables of an earlier form, in this order. A step that has landed is never changed.
const STEPS: &[Step] = &[
    Step {
        form: 2,
        statements: include_str!("steps/2.sql"),
        readable_from: 2,
    },
    Step {
        form: 3,
        statements: include_str!("steps/3.sql"),
        // A program that does not know of the labels would open everything to a key that is bound.
        readable_from: 3,
    },
    Step {
        form: 4,
        statements: include_str!("steps/4.sql"),
        // A new table, which programs before know nothing of.
        readable_from: 3,
    },
    Step {
        form: 5,
        statements: include_str!("steps/5.sql"),
        // Programs before look for templates in a table that is gone.
        readable_from: 5,
    },
    Step {
        form: 6,
        statements: include_str!("steps/6.sql"),
        // Earlier programs look for runs under a tenant that no longer has them.
        readable_from: 6,
    },
    Step {
        form: 7,
        statements: include_str!("steps/7.sql"),
        // Earlier programs cannot read the kind of an evolution.
        readable_from: 7,
    },
    Step {
        form: 8,
        statements: include_str!("steps/8.sql"),
        // An index.
        readable_from: 7,
    },
];

/// The form that is read and written.
const SCHEMA_VERSION: i64 = STEPS[STEPS.len() - 1].form;

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
        sqlx::query("INSERT INTO deployment (one, form) VALUES (1, $1)")
            .bind(FIRST_SCHEMA_VERSION)
            .execute(&mut *transaction)
            .await?;
    }
    let reached = before.unwrap_or(FIRST_SCHEMA_VERSION);
    for step in STEPS.iter().filter(|step| step.form > reached) {
        sqlx::raw_sql(step.statements)
            .execute(&mut *transaction)
            .await?;
        sqlx::query("UPDATE deployment SET form = $1, readable_from = $2")
            .bind(step.form)
            .bind(step.readable_from)
            .execute(&mut *transaction)
            .await?;
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
    let readable_from: i64 = sqlx::query_scalar("SELECT readable_from FROM deployment")
        .fetch_one(connection)
        .await?;
    match readable_from <= SCHEMA_VERSION {
        true => Ok(()),
        false => Err(JobsError::UnsupportedSchema),
    }
}

/// The form of the tables, if there are any.
async fn form(connection: &mut PgConnection) -> Result<Option<i64>, JobsError> {
    let there: bool = sqlx::query_scalar("SELECT to_regclass('deployment') IS NOT NULL")
        .fetch_one(&mut *connection)
        .await?;
    if !there {
        return Ok(None);
    }
    let form = sqlx::query_scalar("SELECT form FROM deployment");
    Ok(form.fetch_optional(connection).await?)
}
