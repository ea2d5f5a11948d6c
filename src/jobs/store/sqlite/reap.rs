//! Takes jobs from workers whose lease has run out, and from a dead process.

use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::model::{Failure, State};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{read_id, read_state, to_json};

/// Those whose worker is silent: single ones count the attempt, those of a group do not and come alone next time.
pub(crate) const REAP: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' \
         WHEN group_size = 1 AND attempt >= $1 THEN 'failed' ELSE 'queued' END, \
     failure = CASE WHEN cancel_requested = 0 AND group_size = 1 AND attempt >= $1 THEN $2 ELSE NULL END, \
     ended_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN $3 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN started_at ELSE NULL END, \
     attempt = CASE WHEN group_size > 1 THEN attempt - 1 ELSE attempt END, \
     suspect = CASE WHEN group_size > 1 THEN 1 ELSE suspect END, \
     progress = done, lease_until = NULL, worker = NULL, solving = 0, version = version + 1 \
     WHERE state = 'running' AND lease_until <= $4 RETURNING id, state";

/// Those of a dead process that were not what it died of, or not certainly: none counts, and those that were being solved
/// come alone next time. Left are those that were solved alone.
pub(crate) const REAP_BYSTANDERS: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
     ended_at = CASE WHEN cancel_requested = 1 THEN $1 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
     attempt = attempt - 1, suspect = CASE WHEN solving = 1 THEN 1 ELSE suspect END, \
     progress = done, lease_until = NULL, worker = NULL, solving = 0, version = version + 1 \
     WHERE state = 'running' AND (solving = 0 OR group_size > 1 \
         OR (SELECT COUNT(*) FROM jobs AS other WHERE other.state = 'running' AND other.solving = 1) > 1) \
     RETURNING id, state";

impl SqliteStore {
    /// Takes running jobs whose lease ended at or before `lease_until` from their workers: to `cancelled` if that was
    /// asked for, to `failed` if the attempts are used up, else back to the queue. Returns them with their new state.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn reap(
        &self,
        lease_until: i64,
        now: i64,
        attempts_max: u32,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        let rows = sqlx::query(REAP)
            .bind(attempts_max)
            .bind(to_json(&Failure::worker_lost(attempts_max))?)
            .bind(now)
            .bind(lease_until)
            .fetch_all(&self.writer)
            .await?;
        rows.iter()
            .map(|row| Ok((read_id(row)?, read_state(row)?)))
            .collect()
    }

    /// Takes all running jobs from a process that died. The attempt counts only for a job that was being solved while no
    /// other was; the others that were being solved come alone next time.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn reap_dead(
        &self,
        now: i64,
        attempts_max: u32,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        let rows = sqlx::query(REAP_BYSTANDERS)
            .bind(now)
            .fetch_all(&self.writer)
            .await?;
        let mut taken = rows
            .iter()
            .map(|row| Ok((read_id(row)?, read_state(row)?)))
            .collect::<Result<Vec<_>, JobsError>>()?;
        taken.extend(self.reap(i64::MAX, now, attempts_max).await?);
        Ok(taken)
    }
}
