//! The schema of the embedded job table: created in an empty file, and migrated from earlier versions. Other files are
//! refused and not changed.
//!
//! `schema.sql` is the oldest supported version. Every later version is a migration, which is one transaction: after a
//! crash between two migrations, the next start continues.

use crate::error::JobsError;
use crate::store::Result;
use crate::store::sqlite::connection::{Connection, Pool, query, query_scalar};

/// The statements that create the tables of the oldest supported version.
const SCHEMA: &str = include_str!("schema.sql");

/// Marks a file as a job table of this service ("rhjb").
const APPLICATION: i64 = 0x7268_6a62;

/// The version of `schema.sql`.
const FIRST_SCHEMA_VERSION: i64 = 7;

/// Migrations, in order: the version after the migration, and its statements. A released migration is never changed.
const STEPS: &[(i64, &str)] = &[
    (8, include_str!("steps/8.sql")),
    (9, include_str!("steps/9.sql")),
    (10, include_str!("steps/10.sql")),
    (11, include_str!("steps/11.sql")),
];

/// The version that this program reads and writes.
const SCHEMA_VERSION: i64 = STEPS[STEPS.len() - 1].0;

/// Creates the tables in an empty file, or migrates them to the version of this program.
///
/// # Errors
/// [`JobsError::UnsupportedSchema`] if the file holds something else or is of a later version, or the database failed.
pub(crate) async fn migrate(writer: &Pool) -> Result<(), JobsError> {
    loop {
        let mut transaction = writer.begin(false).await?;
        let tables: i64 = sql!(scalar fetch_one, &mut *transaction,
            "SELECT COUNT(*) FROM sqlite_schema"
        )?;
        let step = match tables {
            0 => Some(&(FIRST_SCHEMA_VERSION, SCHEMA)),
            _ => match form(&mut transaction).await? {
                SCHEMA_VERSION => return Ok(()),
                form => STEPS.iter().find(|(reached, _)| *reached == form + 1),
            },
        };
        let (reached, statements) = *step.ok_or(JobsError::UnsupportedSchema)?;
        transaction.batch(statements)?;
        transaction.batch(&format!(
            "PRAGMA application_id = {APPLICATION}; PRAGMA user_version = {reached}"
        ))?;
        transaction.commit().await?;
        tracing::debug!(form = reached, "the job table has a new form");
    }
}

/// Requires that a file is a job table of this version; changes nothing.
///
/// # Errors
/// [`JobsError::OldFolder`], [`JobsError::UnsupportedSchema`], or the database failed.
pub(crate) async fn require(pool: &Pool) -> Result<(), JobsError> {
    match form(&mut *pool.acquire().await?).await? {
        SCHEMA_VERSION => Ok(()),
        FIRST_SCHEMA_VERSION..SCHEMA_VERSION => Err(JobsError::OldFolder),
        _ => Err(JobsError::UnsupportedSchema),
    }
}

/// The version of the tables.
async fn form(connection: &mut Connection) -> Result<i64, JobsError> {
    let application: i64 = sql!(scalar fetch_one, &mut *connection, "PRAGMA application_id")?;
    if application != APPLICATION {
        return Err(JobsError::UnsupportedSchema);
    }
    let form = query_scalar("PRAGMA user_version");
    Ok(form.fetch_one(connection).await?)
}

/// Writes the version again, which does not change it.
pub(crate) async fn mark(writer: &Pool) -> Result<()> {
    sql!(
        execute,
        writer,
        format!("PRAGMA user_version = {SCHEMA_VERSION}")
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::store::Store;
    use crate::store::sqlite::database::SqliteStore;

    fn write(file: &std::path::Path, statement: &str) {
        let connection = rusqlite::Connection::open(file).unwrap();
        connection.execute_batch(statement).unwrap();
    }

    #[tokio::test]
    async fn a_table_of_another_version_is_refused_and_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let old = folder.path().join("old.db");
        write(&old, "CREATE TABLE jobs (id TEXT); PRAGMA user_version = 1");
        let newer = folder.path().join("newer.db");
        SqliteStore::open(&newer).await.unwrap().close().await;
        write(&newer, "PRAGMA user_version = 1000");
        for file in [&old, &newer] {
            for opened in [
                SqliteStore::open(file).await,
                SqliteStore::open_existing(file).await,
            ] {
                let error = opened.expect_err("it is of another form").to_string();
                assert!(error.contains("another version of railhead"), "{error}");
            }
        }
        write(&old, "INSERT INTO jobs VALUES ('still there')");
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
