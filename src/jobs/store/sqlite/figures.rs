//! What an operator wants to know of the embedded job table: how many jobs, how old, how large.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use crate::jobs::error::JobsError;
use crate::jobs::job::State;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::{read_count, read_state};

const COUNT: &str = "SELECT state, SUM(number) AS jobs FROM job_counts GROUP BY state";
const RESULT_BYTES: &str = "SELECT COALESCE(SUM(bytes), 0) FROM blobs WHERE key IS NOT NULL";

/// Figures of a job table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figures {
    /// Number of jobs in each state; every state is there.
    pub jobs: BTreeMap<State, u64>,
    /// Time of submission of the oldest queued job, epoch milliseconds.
    pub oldest_queued_at: Option<i64>,
    /// Size of the database file and its write-ahead log.
    pub database_bytes: u64,
    /// Size of the results outside the table.
    pub result_bytes: u64,
}

impl SqliteStore {
    /// The figures as they are now.
    ///
    /// # Errors
    /// The database failed.
    pub async fn figures(&self) -> Result<Figures, JobsError> {
        let rows = sqlx::query(COUNT).fetch_all(&self.readers).await?;
        let mut jobs: BTreeMap<State, u64> =
            State::ALL.into_iter().map(|state| (state, 0)).collect();
        for row in &rows {
            jobs.insert(read_state(row)?, read_count(row, "jobs")?);
        }
        let oldest_queued_at =
            sqlx::query_scalar("SELECT MIN(created_at) FROM jobs WHERE id = (SELECT MIN(id) FROM jobs WHERE state = 'queued')")
                .fetch_one(&self.readers)
                .await?;
        let result_bytes: i64 = sqlx::query_scalar(RESULT_BYTES)
            .fetch_one(&self.readers)
            .await?;
        let mut log = OsString::from(self.file.as_os_str());
        log.push("-wal");
        Ok(Figures {
            jobs,
            oldest_queued_at,
            database_bytes: size(&self.file).await + size(Path::new(&log)).await,
            result_bytes: u64::try_from(result_bytes).unwrap_or(0),
        })
    }
}

/// Size of a file, 0 if there is none.
async fn size(file: &Path) -> u64 {
    tokio::fs::metadata(file)
        .await
        .map_or(0, |about| about.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn figures_are_read_from_indices_alone() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        let steps = plan(&store, RESULT_BYTES).await;
        assert!(steps[0].contains("COVERING INDEX"), "{steps:?}");
        let steps = plan(&store, COUNT).await;
        assert_eq!(steps, ["SCAN job_counts"], "a row per state and tenant");
    }
}
