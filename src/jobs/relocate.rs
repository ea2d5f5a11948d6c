//! Moves what is in a data folder into a database that several nodes share: `railhead move`.

use std::path::Path;

use crate::blobs::Blobs;
use crate::error::{JobsError, Result};
use crate::lifecycle::lock_folder;
use crate::metrics::StoreRequests;
use crate::open_store::table_file;
use crate::options::Options;
use crate::result_place::settle::settle;
use crate::result_place::url::ResultsPlace;
use crate::store::postgres::database::PostgresStore;
use crate::store::sqlite::database::SqliteStore;
use crate::store::{Reap, Store, Upkeep};

/// What the job table is called once its rows are elsewhere, so that no service starts on it.
const MOVED: &str = "jobs.db.moved";

/// What was moved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    /// The rows of each table.
    pub rows: Vec<(&'static str, usize)>,
    /// Results outside the table, and their bytes.
    pub results: usize,
    /// Bytes of these.
    pub result_bytes: u64,
    /// Results outside the table that are not there; their jobs are moved without.
    pub missing: usize,
}

/// Moves the jobs, batches, keys and profiles of a data folder, which no service uses, into a database without jobs, and its large
/// results into the place of that database. What was running is queued again, as by a start of the service. The data folder keeps its
/// results; its table gets another name.
///
/// Results come first, then all rows in one transaction: whatever fails, the data folder can be used as before.
///
/// # Errors
/// The folder is in use or has no job table, the database has jobs or no tables, or something cannot be read or written.
pub async fn relocate(data_dir: &Path, url: &str, place: Option<&ResultsPlace>) -> Result<Moved> {
    let table = table_file(data_dir);
    let failed = |source| JobsError::DataDir {
        path: table.clone(),
        source,
    };
    // Not made by the lock of the folder.
    std::fs::metadata(&table).map_err(failed)?;
    let _lock = lock_folder(data_dir)?;
    let from = SqliteStore::open_existing(&table).await?;
    let to = PostgresStore::open(url, 4).await?;
    to.require_empty().await?;
    let now = jiff::Timestamp::now().as_millisecond();
    let attempts_max = Options::new(data_dir).attempts_max;
    Upkeep::reap(&from, Reap::Dead, now, attempts_max).await?;
    let results = settle(&to, place, StoreRequests::default()).await?;
    let mut moved = Moved {
        rows: Vec::new(),
        results: 0,
        result_bytes: 0,
        missing: 0,
    };
    let here = Blobs::open(data_dir)?;
    for key in from.large_results().await? {
        match here.copy(&key, &results).await? {
            Some(bytes) => {
                moved.results += 1;
                moved.result_bytes += bytes;
            }
            None => moved.missing += 1,
        }
    }
    moved.rows = to.import(&from).await?;
    from.close().await;
    to.close().await;
    std::fs::rename(&table, data_dir.join(MOVED)).map_err(failed)?;
    Ok(moved)
}
