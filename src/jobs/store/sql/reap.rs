//! Takes jobs from workers whose lease has run out, and from a dead process.

use super::blob_refs::drop_slices_of_ended;
use super::engine::{self, SqlStore};
use super::rows::{read_move, to_json};
use crate::jobs::store::claim::Reap;
use uuid::Uuid;

use crate::jobs::model::job::{Failure, State};
use crate::jobs::store_error::StoreError;

/// Those whose lease has run out: a job that was claimed alone counts the attempt; those of a group do not, and come alone next
/// time.
pub(crate) const REAP: &str = concat!(
    "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' \
         WHEN group_size = 1 AND attempt >= $1 THEN 'failed' ELSE 'queued' END, \
     failure = CASE WHEN cancel_requested = 0 AND group_size = 1 AND attempt >= $1 THEN $2 ELSE NULL END, \
     ended_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN $3 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN started_at ELSE NULL END, \
     attempt = CASE WHEN group_size > 1 THEN attempt - 1 ELSE attempt END, \
     suspect = CASE WHEN group_size > 1 THEN 1 ELSE suspect END, \
     progress = done, lease_until = NULL, worker = NULL, solving = 0, version = version + 1, updated_at = $3 \
     WHERE state = 'running' AND lease_until <= ",
    lease_now!("$4"),
    " RETURNING id, state, slices"
);

/// Those of a dead process that were not, or not certainly, the cause of its death: none counts the attempt, and those that
/// were being solved come alone next time. What is left was solved alone.
pub(crate) const REAP_BYSTANDERS: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
     ended_at = CASE WHEN cancel_requested = 1 THEN $1 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
     attempt = attempt - 1, suspect = CASE WHEN solving = 1 THEN 1 ELSE suspect END, \
     progress = done, lease_until = NULL, worker = NULL, solving = 0, version = version + 1, updated_at = $1 \
     WHERE state = 'running' AND (solving = 0 OR group_size > 1 \
         OR (SELECT COUNT(*) FROM jobs AS other WHERE other.state = 'running' AND other.solving = 1) > 1) \
     RETURNING id, state, slices";

impl SqlStore {
    /// Takes running jobs from their workers; see [`Reap`].
    pub(crate) async fn reap(
        &self,
        which: Reap,
        now: i64,
        attempts_max: u32,
    ) -> Result<Vec<(Uuid, State)>, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let mut rows = Vec::new();
        let late = match which {
            Reap::Expired { now } => self.lease_now(now),
            Reap::Dead => {
                let bystanders = sqlx::query(REAP_BYSTANDERS).bind(now);
                rows = bystanders.fetch_all(&mut *transaction).await?;
                Some(i64::MAX)
            }
        };
        let expired = sqlx::query(REAP)
            .bind(i64::from(attempts_max))
            .bind(to_json(&Failure::worker_lost(attempts_max))?)
            .bind(now)
            .bind(late)
            .fetch_all(&mut *transaction)
            .await?;
        rows.extend(expired);
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        self.requeued();
        rows.iter()
            .map(|row| read_move(row, State::Running))
            .collect()
    }
}
