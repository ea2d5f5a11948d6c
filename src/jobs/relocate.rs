//! `railhead move`: moves the contents of a data folder into a shared database.

use std::path::Path;

use crate::blobs::{Blobs, Copied};
use crate::data_dir::lock_folder;
use crate::data_dir::table_file;
use crate::error::{JobsError, Result};
use crate::metrics::StoreRequests;
use crate::options::Options;
use crate::result_place::settle::settle;
use crate::result_place::url::ResultsPlace;
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;
use crate::store::{Reap, Store, Upkeep};

/// Name of the job table after the move, so that no service starts on it.
const MOVED: &str = "jobs.db.moved";

/// Result of [`relocate`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    /// Number of rows of each table.
    pub rows: Vec<(&'static str, usize)>,
    /// The large results.
    pub results: Copied,
}

/// Moves the jobs, batches, keys and profiles of a data folder that no service uses into a database without jobs, and its
/// large results into the location of that database. Running jobs are queued again. The data folder keeps its results, and
/// its table is renamed.
///
/// Results are copied first, then all rows in one transaction: after a failure the data folder can be used as before.
///
/// # Errors
/// The folder is in use or has no job table, the database has jobs or no tables, or a read or write failed.
pub async fn relocate(data_dir: &Path, url: &str, place: Option<&ResultsPlace>) -> Result<Moved> {
    let table = table_file(data_dir);
    // The lock creates the folder, so the check comes first.
    std::fs::metadata(&table).map_err(JobsError::at(&table))?;
    let _lock = lock_folder(data_dir)?;
    let from = SqliteStore::open_existing(&table).await?;
    let to = PostgresStore::open(url, 4).await?;
    to.require_empty().await?;
    let now = jiff::Timestamp::now().as_millisecond();
    let attempts_max = Options::new(data_dir).attempts_max;
    Upkeep::reap(&from, Reap::Dead, now, attempts_max).await?;
    let results = settle(&to, place, StoreRequests::default()).await?;
    let mut copied = Copied::default();
    let here = Blobs::open(data_dir)?;
    for key in from.large_results().await? {
        copied.add(here.copy(&key, &results).await?);
    }
    let rows = to.import(&from).await?;
    from.close().await;
    to.close().await;
    std::fs::rename(&table, data_dir.join(MOVED)).map_err(JobsError::at(&table))?;
    Ok(Moved {
        rows,
        results: copied,
    })
}
