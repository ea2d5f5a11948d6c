//! Jobs of the embedded table whose deadline has passed.

use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, State};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::{read_id, read_state, to_json};

const LATE: &str =
    "SELECT id, state FROM jobs WHERE deadline <= $1 AND deadline IS NOT NULL AND ended_at IS NULL";
const FAIL_LATE: &str = "UPDATE jobs SET state = 'failed', failure = $1, ended_at = $2, version = version + 1 \
     WHERE deadline <= $2 AND deadline IS NOT NULL AND ended_at IS NULL AND state || '' = 'queued' RETURNING id";

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Late {
    /// There are queued ones.
    pub queued: bool,
    /// The running ones.
    pub running: Vec<Uuid>,
}

impl SqliteStore {
    /// The jobs that have not ended at `now`, at or after their deadline.
    ///
    /// # Errors
    /// The database failed.
    pub async fn late(&self, now: i64) -> Result<Late, JobsError> {
        let rows = sqlx::query(LATE).bind(now).fetch_all(&self.readers).await?;
        let mut late = Late::default();
        for row in &rows {
            match read_state(row)? {
                State::Queued => late.queued = true,
                _ => late.running.push(read_id(row)?),
            }
        }
        Ok(late)
    }

    /// Ends the queued ones among them with this failure; returns them.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn fail_late(&self, failure: &Failure, now: i64) -> Result<Vec<Uuid>, JobsError> {
        let rows = sqlx::query(FAIL_LATE)
            .bind(to_json(failure)?)
            .bind(now)
            .fetch_all(&self.writer)
            .await?;
        rows.iter().map(read_id).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn jobs_without_a_deadline_are_not_looked_at() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for statement in [LATE, FAIL_LATE] {
            let steps = plan(&store, statement).await;
            assert!(
                steps[0].contains("jobs_by_deadline (deadline>? AND deadline<?)")
                    || steps[0].contains("jobs_by_deadline (deadline<?)"),
                "{steps:?}"
            );
        }
    }
}
