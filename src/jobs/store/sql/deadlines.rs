//! Jobs of the embedded table whose deadline has passed.

use super::blob_refs::drop_slices_of_ended;
use super::engine::{self, SqlStore};
use super::rows::{read_id, read_move, read_state, to_json};
use crate::jobs::store::retention::Overdue;
use uuid::Uuid;

use crate::jobs::model::job::{Failure, State};
use crate::jobs::store::retention::Moment;
use crate::jobs::store_error::StoreError;

/// Late at $1; what was submitted before $2 is late only if it is at $3.
pub(crate) const LATE: &str = "SELECT id, state FROM jobs WHERE deadline <= $1 AND deadline IS NOT NULL AND ended_at IS NULL \
     AND (created_at >= $2 OR deadline <= $3)";

pub(crate) const FAIL_LATE: &str = concat!(
    "WITH late AS MATERIALIZED (SELECT id FROM jobs WHERE deadline <= $1 AND deadline IS NOT NULL AND ended_at IS NULL \
     AND (created_at >= $2 OR deadline <= $3) AND ",
    bare!("state"),
    " = 'queued' LIMIT $5",
    skip_locked!(),
    ") \
     UPDATE jobs SET state = 'failed', failure = $4, ended_at = $1, updated_at = $1, version = version + 1 \
     WHERE id IN (SELECT id FROM late) RETURNING id, state, slices"
);

/// Jobs ended in one transaction, whose rows are locked until it ends. Chosen by judgement: some tens of milliseconds.
const AT_ONCE: i64 = 1000;

impl SqlStore {
    /// Ends some of the queued jobs whose deadline has passed with this failure, and names the running ones.
    pub(crate) async fn pass_deadlines(
        &self,
        failure: &Failure,
        moment: Moment,
    ) -> Result<Overdue, StoreError> {
        // Late jobs are rare, and a read holds no writer up.
        let rows = sqlx::query(LATE)
            .bind(moment.now)
            .bind(moment.set_at)
            .bind(moment.unset)
            .fetch_all(&self.readers)
            .await?;
        let (mut queued, mut overdue) = (false, Overdue::default());
        for row in &rows {
            match read_state(row)? {
                State::Queued => queued = true,
                _ => overdue.running.push(read_id(row)?),
            }
        }
        if queued {
            overdue.ended = self.fail_late(failure, moment).await?;
        }
        Ok(overdue)
    }

    async fn fail_late(&self, failure: &Failure, moment: Moment) -> Result<Vec<Uuid>, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = sqlx::query(FAIL_LATE)
            .bind(moment.now)
            .bind(moment.set_at)
            .bind(moment.unset)
            .bind(to_json(failure)?)
            .bind(AT_ONCE)
            .fetch_all(&mut *transaction)
            .await?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        rows.iter()
            .map(|row| Ok(read_move(row, State::Queued)?.0))
            .collect()
    }
}
