//! Import of an embedded job table into an empty database, in one transaction.

use sqlx::postgres::PgConnection;
use sqlx::query_scalar;
use sqlx::{AssertSqlSafe, Connection};

use crate::error::JobsError;
use crate::store::Result;
use crate::store::postgres::connection::{ADMISSION, lock};
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;

/// The imported tables, referenced tables first. Counters are computed again by the database.
const TABLES: [&str; 13] = [
    "templates",
    "batches",
    "blobs",
    "jobs",
    "cases",
    "job_labels",
    "job_slices",
    "blob_outbox",
    "batch_keys",
    "idempotency_keys",
    "tombstones",
    "api_keys",
    "profiles",
];

/// Tables in which nodes may have inserted rows already, which are kept.
const ONCE: [&str; 3] = ["tombstones", "api_keys", "profiles"];

impl PostgresStore {
    /// Requires that there is no job and no batch.
    ///
    /// # Errors
    /// [`JobsError::DatabaseNotEmpty`], or the database failed.
    pub(crate) async fn require_empty(&self) -> Result<(), JobsError> {
        require_empty(&mut *self.writer.acquire().await?).await
    }

    /// Imports all rows of an embedded table; returns the number of rows of each table.
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
        // Nothing is accepted in the meantime.
        lock(&mut transaction, ADMISSION).await?;
        require_empty(&mut transaction).await?;
        let mut moved = Vec::new();
        for table in TABLES {
            let columns = from.columns(table).await?;
            let insert = insertion(table, &columns);
            let (mut portions, reading) = from.portions(table, &columns).await?;
            let mut rows = 0;
            while let Some((number, portion)) = portions.recv().await {
                rows += number;
                let insert = sqlx::query(AssertSqlSafe(insert.clone())).bind(portion);
                insert.execute(&mut *transaction).await?;
            }
            let read = reading.await;
            read.map_err(|error| JobsError::Damaged(error.to_string()))??;
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

/// The statement that inserts a portion of a table, which is its parameter.
fn insertion(table: &str, columns: &[(String, String)]) -> String {
    let (mut names, mut values, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for (name, kind) in columns {
        let (value, kind) = match kind.as_str() {
            "INTEGER" => (format!("\"{name}\""), "bigint"),
            "REAL" => (format!("\"{name}\""), "double precision"),
            "BLOB" => (format!("decode(\"{name}\", 'hex')"), "text"),
            _ => (format!("\"{name}\""), "text"),
        };
        names.push(format!("\"{name}\""));
        values.push(value);
        types.push(format!("\"{name}\" {kind}"));
    }
    let known = match ONCE.contains(&table) {
        true => "ON CONFLICT DO NOTHING",
        false => "",
    };
    format!(
        "INSERT INTO {table} ({}) SELECT {} FROM json_to_recordset(CAST($1 AS json)) AS moved ({}) {known}",
        names.join(", "),
        values.join(", "),
        types.join(", "),
    )
}
