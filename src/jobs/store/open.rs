//! Opens the store of a service or of a command.

use std::path::Path;
use std::sync::Arc;

use crate::data_dir::{self, table_file};
use crate::error::{JobsError, Result};
use crate::options::{Database, NotifyMode};
use crate::store::Store;
#[cfg(feature = "cluster")]
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;

/// Opens the store of a service: the shared database, or the table of its data folder, which no other process uses. The
/// table is checked for damage unless it was closed in good order.
///
/// # Errors
/// The store cannot be opened, has another version, or is damaged.
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
    let closed = data_dir::take_closed_mark(data_dir);
    let unclean = !closed && table.exists();
    let store = match SqliteStore::open(&table).await {
        Err(error) if error.storage_fault().is_some() && data_dir::remove_reserve(data_dir) => {
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

/// Opens the store of a data folder that a service may be using.
///
/// # Errors
/// The store cannot be opened, or has another version.
pub async fn open_beside(data_dir: &Path) -> Result<Arc<dyn Store>> {
    Ok(Arc::new(SqliteStore::open(&table_file(data_dir)).await?))
}

/// Opens a database that services may be using.
///
/// # Errors
/// The database cannot be reached, has no job table, or one of another version.
pub async fn open_shared(url: &str) -> Result<Arc<dyn Store>> {
    open_database(&Database {
        connections: 1,
        notify_mode: NotifyMode::Database,
        url: url.to_owned(),
    })
    .await
}
