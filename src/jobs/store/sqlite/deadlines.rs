//! Jobs of the embedded table whose deadline has passed.

use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::model::{Failure, State};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{read_id, read_state, to_json};
use crate::jobs::store::types::Moment;

/// Late at $1; what was submitted before $2 is late only if it is at $3.
const LATE: &str = "SELECT id, state FROM jobs WHERE deadline <= $1 AND deadline IS NOT NULL AND ended_at IS NULL \
     AND (created_at >= $2 OR deadline <= $3)";

const FAIL_LATE: &str = "UPDATE jobs SET state = 'failed', failure = $4, ended_at = $1, version = version + 1 \
     WHERE id IN (SELECT id FROM jobs WHERE deadline <= $1 AND deadline IS NOT NULL AND ended_at IS NULL \
     AND (created_at >= $2 OR deadline <= $3) AND state || '' = 'queued' LIMIT $5) RETURNING id";

/// Jobs ended in one transaction.
const AT_ONCE: i64 = 1000;

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overdue {
    /// There are queued ones.
    pub queued: bool,
    /// The running ones.
    pub running: Vec<Uuid>,
}

impl SqliteStore {
    /// The jobs that have not ended at their deadline.
    ///
    /// # Errors
    /// The database failed.
    pub async fn late(&self, moment: Moment) -> Result<Overdue, JobsError> {
        let rows = sqlx::query(LATE)
            .bind(moment.now)
            .bind(moment.set_at)
            .bind(moment.unset)
            .fetch_all(&self.readers)
            .await?;
        let mut late = Overdue::default();
        for row in &rows {
            match read_state(row)? {
                State::Queued => late.queued = true,
                _ => late.running.push(read_id(row)?),
            }
        }
        Ok(late)
    }

    /// Ends some of the queued ones among them with this failure; returns them, and none once there are no more.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn fail_late(
        &self,
        failure: &Failure,
        moment: Moment,
    ) -> Result<Vec<Uuid>, JobsError> {
        let rows = sqlx::query(FAIL_LATE)
            .bind(moment.now)
            .bind(moment.set_at)
            .bind(moment.unset)
            .bind(to_json(failure)?)
            .bind(AT_ONCE)
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
            let seeks = |step: &String| step.contains("jobs_by_deadline (deadline");
            assert!(steps.iter().any(seeks), "{steps:?}");
            assert!(
                !steps.iter().any(|step| step.starts_with("SCAN")),
                "{steps:?}"
            );
        }
    }
}
