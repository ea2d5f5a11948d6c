//! The schema of the shared job table: made once by a command of the operator, required by every node.

use sqlx::postgres::PgPool;

use crate::jobs::error::JobsError;
use crate::jobs::store::postgres::connection::{self, connect, lock};

/// The statements that make an empty schema a job table.
const SCHEMA: &str = include_str!("schema.sql");

/// The version of `schema.sql` that is read and written; it grows with every change of that file.
const FORM: i64 = 1;

/// What [`migrate`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Migrated {
    /// The tables were made.
    Made,
    /// They were there.
    WasThere,
}

/// Makes the tables in the first schema of the search path, if they are not there. Several may do so at once.
///
/// # Errors
/// [`JobsError::OtherForm`] if there are tables of another version, or the database failed.
pub async fn migrate(url: &str) -> Result<Migrated, JobsError> {
    let (_, pool) = connect(url, 1).await?;
    let made = make(&pool).await;
    pool.close().await;
    made
}

async fn make(pool: &PgPool) -> Result<Migrated, JobsError> {
    let mut transaction = pool.begin().await?;
    // Ends with the transaction: a lock of the session would not pass a pooler.
    lock(&mut transaction, connection::SCHEMA).await?;
    if is_there(&mut transaction).await? {
        drop(transaction);
        require(pool).await?;
        return Ok(Migrated::WasThere);
    }
    sqlx::raw_sql(SCHEMA).execute(&mut *transaction).await?;
    sqlx::query("INSERT INTO deployment (one, form) VALUES (1, $1)")
        .bind(FORM)
        .execute(&mut *transaction)
        .await?;
    transaction.commit().await?;
    Ok(Migrated::Made)
}

/// Requires that the tables are there in this version; changes nothing.
///
/// # Errors
/// [`JobsError::NotMigrated`], [`JobsError::OtherForm`], or the database failed.
pub(crate) async fn require(pool: &PgPool) -> Result<(), JobsError> {
    let mut connection = pool.acquire().await?;
    if !is_there(&mut connection).await? {
        return Err(JobsError::NotMigrated);
    }
    let form: i64 = sqlx::query_scalar("SELECT form FROM deployment")
        .fetch_one(&mut *connection)
        .await?;
    match form == FORM {
        true => Ok(()),
        false => Err(JobsError::OtherForm),
    }
}

async fn is_there(connection: &mut sqlx::PgConnection) -> Result<bool, JobsError> {
    Ok(
        sqlx::query_scalar("SELECT to_regclass('deployment') IS NOT NULL")
            .fetch_one(connection)
            .await?,
    )
}
