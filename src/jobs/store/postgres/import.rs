//! Takes the rows of an embedded job table into an empty database, all of them or none.

use sqlx::postgres::PgConnection;
use sqlx::query_scalar;
use sqlx::{AssertSqlSafe, Connection};

use crate::error::JobsError;
use crate::store::Result;
use crate::store::portion::{Portion, TABLES, Values};
use crate::store::postgres::connection::{ADMISSION, lock};
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;

/// What nodes may have made before: rows that are there stay as they are.
const ONCE: [&str; 3] = ["tombstones", "api_keys", "profiles"];

impl PostgresStore {
    /// There is no job and no batch.
    ///
    /// # Errors
    /// [`JobsError::DatabaseNotEmpty`], or the database failed.
    pub(crate) async fn require_empty(&self) -> Result<(), JobsError> {
        require_empty(&mut *self.writer.acquire().await?).await
    }

    /// Takes all rows of an embedded table; the number of those of each table.
    ///
    /// # Errors
    /// [`JobsError::DatabaseNotEmpty`], or one of the databases failed; nothing changed.
    pub(crate) async fn import(
        &self,
        from: &SqliteStore,
    ) -> Result<Vec<(&'static str, usize)>, JobsError> {
        let mut connection = self.writer.acquire().await?;
        let mut transaction = connection.begin().await?;
        sqlx::raw_sql("SET LOCAL statement_timeout = 0; SET LOCAL idle_in_transaction_session_timeout = '60s'")
            .execute(&mut *transaction)
            .await?;
        // Nothing is accepted meanwhile.
        lock(&mut transaction, ADMISSION).await?;
        require_empty(&mut transaction).await?;
        let mut moved = Vec::new();
        for table in TABLES {
            let (mut rows, mut portions) = (0, from.portions(table));
            while let Some(portion) = portions.recv().await {
                let portion = portion?;
                rows += portion.rows;
                insert(&mut transaction, table, portion).await?;
            }
            moved.push((table, rows));
        }
        sqlx::raw_sql(
            "SELECT setval('blob_ids', (SELECT COALESCE(MAX(id), 0) + 1 FROM blobs), false)",
        )
        .execute(&mut *transaction)
        .await?;
        transaction.commit().await?;
        Ok(moved)
    }
}

async fn require_empty(connection: &mut PgConnection) -> Result<(), JobsError> {
    let filled = "SELECT EXISTS (SELECT 1 FROM jobs) OR EXISTS (SELECT 1 FROM batches)";
    match sql!(scalar fetch_one, connection, filled)? {
        true => Err(JobsError::DatabaseNotEmpty),
        false => Ok(()),
    }
}

async fn insert(connection: &mut PgConnection, table: &str, portion: Portion) -> Result<()> {
    let (mut names, mut arrays) = (Vec::new(), Vec::new());
    for (place, (name, values)) in portion.columns.iter().enumerate() {
        let kind = match values {
            Values::Text(_) => "text",
            Values::Integer(_) => "bigint",
            Values::Real(_) => "double precision",
            Values::Bytes(_) => "bytea",
        };
        names.push(format!("\"{name}\""));
        arrays.push(format!("CAST(${} AS {kind}[])", place + 1));
    }
    let statement = format!(
        "INSERT INTO {table} ({}) SELECT * FROM unnest({}){}",
        names.join(", "),
        arrays.join(", "),
        if ONCE.contains(&table) {
            " ON CONFLICT DO NOTHING"
        } else {
            ""
        },
    );
    let mut insert = sqlx::query(AssertSqlSafe(statement));
    for (_, values) in portion.columns {
        insert = match values {
            Values::Text(values) => insert.bind(values),
            Values::Integer(values) => insert.bind(values),
            Values::Real(values) => insert.bind(values),
            Values::Bytes(values) => insert.bind(values),
        };
    }
    insert.execute(connection).await?;
    Ok(())
}
