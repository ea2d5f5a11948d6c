//! Which store a data folder has, and how it is opened: the only place, besides its backup, that knows one store from another.

use std::fs::File;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::disk_reserve;
use crate::error::{JobsError, Result};
use crate::options::{Database, NotifyMode};
use crate::store::Store;
#[cfg(feature = "cluster")]
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;

/// The file that says that the job table was closed in good order.
const CLOSED: &str = "closed";

/// The file of the embedded job table.
#[must_use]
pub fn table_file(data_dir: &Path) -> PathBuf {
    data_dir.join("jobs.db")
}

/// Opens the store for a service: the database that it shares with others, or the one of its data folder, of which it is the
/// only user. The latter is checked for damage unless it was closed in good order.
///
/// # Errors
/// It cannot be opened, is of another version, or is damaged.
pub async fn open_for_service(
    data_dir: &Path,
    database: Option<&Database>,
) -> Result<Arc<dyn Store>> {
    let Some(database) = database else {
        return open_embedded(data_dir).await;
    };
    let table = table_file(data_dir);
    if table.exists() {
        return Err(JobsError::DataDirOfEmbedded(table));
    }
    open_database(database).await
}

#[cfg(feature = "cluster")]
async fn open_database(database: &Database) -> Result<Arc<dyn Store>> {
    let store = PostgresStore::open(&database.url, database.connections).await?;
    Ok(Arc::new(store.with_notify_mode(&database.notify_mode)?))
}

#[cfg(not(feature = "cluster"))]
async fn open_database(_: &Database) -> Result<Arc<dyn Store>> {
    Err(JobsError::NotBuilt {
        what: "PostgreSQL",
        feature: "cluster",
    })
}

async fn open_embedded(data_dir: &Path) -> Result<Arc<dyn Store>> {
    let table = table_file(data_dir);
    // After an end that closed the table there is nothing to be checked.
    let closed = std::fs::remove_file(data_dir.join(CLOSED)).is_ok();
    let unclean = !closed && table.exists();
    let store = match SqliteStore::open(&table).await {
        Err(error) if error.storage_fault().is_some() && disk_reserve::give_back(data_dir) => {
            tracing::warn!(%error, "the job table is opened on the reserve");
            SqliteStore::open(&table).await?
        }
        opened => opened?,
    };
    if unclean {
        store.check().await?;
    }
    Ok(Arc::new(store))
}

/// Opens the store of a data folder beside a service that may be running.
///
/// # Errors
/// It cannot be opened, or is of another version.
pub async fn open_beside(data_dir: &Path) -> Result<Arc<dyn Store>> {
    Ok(Arc::new(SqliteStore::open(&table_file(data_dir)).await?))
}

/// Opens a database beside the services that use it.
///
/// # Errors
/// It cannot be reached, has no job table, or one of another version.
pub async fn open_shared(url: &str) -> Result<Arc<dyn Store>> {
    open_database(&Database {
        connections: 1,
        notify_mode: NotifyMode::Database,
        url: url.to_owned(),
    })
    .await
}

/// Notes that the store was closed in good order.
pub fn note_closed(data_dir: &Path) {
    let marked = File::options()
        .create(true)
        .truncate(true)
        .write(true)
        .mode(0o600)
        .open(data_dir.join(CLOSED));
    if let Err(error) = marked {
        tracing::debug!(%error, "the next start will check the job table");
    }
}
