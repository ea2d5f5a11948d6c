//! The schema of the embedded job table: made in an empty file, required in every other. A file of another version is refused
//! and left as it is.

use sqlx::sqlite::SqlitePool;

use crate::jobs::error::JobsError;

/// The statements that make an empty file a job table.
const SCHEMA: &str = include_str!("schema.sql");

/// Marks a file as a job table of this service ("rhjb").
const APPLICATION: i64 = 0x7268_6a62;

/// The version of `schema.sql` that is read and written; it grows with every change of that file.
const FORM: i64 = 7;

/// Makes the tables in an empty file.
///
/// # Errors
/// [`JobsError::OtherForm`] if the file holds something else, or the database failed.
pub(crate) async fn make_or_require(writer: &SqlitePool) -> Result<(), JobsError> {
    let mut transaction = writer.begin_with("BEGIN IMMEDIATE").await?;
    let tables: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM sqlite_schema")
        .fetch_one(&mut *transaction)
        .await?;
    if tables > 0 {
        drop(transaction);
        return require(writer).await;
    }
    sqlx::raw_sql(SCHEMA).execute(&mut *transaction).await?;
    let marks = format!("PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {FORM}");
    sqlx::raw_sql(sqlx::AssertSqlSafe(marks))
        .execute(&mut *transaction)
        .await?;
    transaction.commit().await?;
    Ok(())
}

/// Requires that a file is a job table of this version; changes nothing.
///
/// # Errors
/// [`JobsError::OtherForm`], or the database failed.
pub(crate) async fn require(pool: &SqlitePool) -> Result<(), JobsError> {
    let application: i64 = sqlx::query_scalar("PRAGMA application_id")
        .fetch_one(pool)
        .await?;
    let form: i64 = sqlx::query_scalar("PRAGMA user_version")
        .fetch_one(pool)
        .await?;
    if (application, form) == (APPLICATION, FORM) {
        return Ok(());
    }
    Err(JobsError::OtherForm)
}

/// Writes the number of the version again: a page that stays as it was.
pub(crate) async fn mark(writer: &SqlitePool) -> sqlx::Result<()> {
    sqlx::raw_sql(sqlx::AssertSqlSafe(format!("PRAGMA user_version = {FORM}")))
        .execute(writer)
        .await?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};

    use crate::jobs::store::sqlite::database::SqliteStore;

    async fn write(file: &std::path::Path, statement: &'static str) {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true);
        let pool = SqlitePoolOptions::new()
            .connect_with(options)
            .await
            .unwrap();
        sqlx::raw_sql(statement).execute(&pool).await.unwrap();
        pool.close().await;
    }

    #[tokio::test]
    async fn a_table_of_another_version_is_refused_and_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let old = folder.path().join("old.db");
        write(&old, "CREATE TABLE jobs (id TEXT); PRAGMA user_version = 1").await;
        let newer = folder.path().join("newer.db");
        SqliteStore::open(&newer).await.unwrap().close().await;
        write(&newer, "PRAGMA user_version = 1000").await;
        for file in [&old, &newer] {
            for opened in [
                SqliteStore::open(file).await,
                SqliteStore::open_existing(file).await,
            ] {
                let error = opened.expect_err("it is of another form").to_string();
                assert!(error.contains("another version of railhead"), "{error}");
            }
        }
        write(&old, "INSERT INTO jobs VALUES ('still there')").await;
    }

    #[tokio::test]
    async fn beside_a_service_nothing_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        assert!(SqliteStore::open_existing(&file).await.is_err());
        assert!(!file.exists());
        SqliteStore::open(&file).await.unwrap().close().await;
        SqliteStore::open_existing(&file).await.unwrap();
    }

    #[tokio::test]
    async fn the_table_is_for_nobody_else_to_read() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("jobs.db");
        let _open = SqliteStore::open(&file).await.unwrap();
        for entry in std::fs::read_dir(folder.path()).unwrap() {
            let entry = entry.unwrap();
            let mode = entry.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{:?}", entry.file_name());
        }
    }
}
