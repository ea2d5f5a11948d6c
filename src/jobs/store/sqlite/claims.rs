//! What workers ask of the embedded job table: claim, renew, finish, hand back, and take from the dead.

use sqlx::Row;
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, Job, State};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::{
    job_columns, read_count, read_id, read_job, read_state, to_json,
};
use crate::jobs::store::{Claim, Ending, Renewal};

const CLAIM: &str = "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_number = lease_number + 1, \
     lease_until = $1, worker = $2, started_at = $3, progress = 0, version = version + 1 \
     WHERE id = (SELECT id FROM jobs WHERE state = 'queued' ORDER BY id LIMIT 1) \
     RETURNING id, attempt, lease_number, method";

const REAP: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' WHEN attempt >= $1 THEN 'failed' ELSE 'queued' END, \
     failure = CASE WHEN cancel_requested = 0 AND attempt >= $1 THEN $2 ELSE NULL END, \
     ended_at = CASE WHEN cancel_requested = 1 OR attempt >= $1 THEN $3 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 OR attempt >= $1 THEN started_at ELSE NULL END, \
     progress = 0, lease_until = NULL, worker = NULL, version = version + 1 \
     WHERE state = 'running' AND lease_until <= $4 RETURNING id, state";

impl SqliteStore {
    /// Claims the oldest queued job for `lease_ms` milliseconds.
    ///
    /// # Errors
    /// The database failed.
    pub async fn claim(
        &self,
        worker: &str,
        now: i64,
        lease_ms: i64,
    ) -> Result<Option<Claim>, JobsError> {
        let row = sqlx::query(CLAIM)
            .bind(now.saturating_add(lease_ms))
            .bind(worker)
            .bind(now)
            .fetch_optional(&self.writer)
            .await?;
        let Some(row) = row else { return Ok(None) };
        Ok(Some(Claim {
            id: read_id(&row)?,
            attempt: row.try_get("attempt")?,
            lease_number: read_count(&row, "lease_number")?,
            method: row.try_get("method")?,
        }))
    }

    /// Extends a lease and notes the progress.
    ///
    /// # Errors
    /// The database failed; the lease stands as it was.
    pub async fn renew(
        &self,
        claim: &Claim,
        progress: f64,
        now: i64,
        lease_ms: i64,
    ) -> Result<Renewal, JobsError> {
        let row = sqlx::query(
            "UPDATE jobs SET lease_until = $1, progress = $2, \
             version = CASE WHEN progress = $2 THEN version ELSE version + 1 END \
             WHERE id = $3 AND lease_number = $4 AND state = 'running' RETURNING cancel_requested",
        )
        .bind(now.saturating_add(lease_ms))
        .bind(progress)
        .bind(claim.id.to_string())
        .bind(fence(claim))
        .fetch_optional(&self.writer)
        .await?;
        Ok(match row {
            Some(row) => Renewal::Held {
                cancel_requested: row.try_get("cancel_requested")?,
            },
            None => Renewal::Lost,
        })
    }

    /// Ends a job. `None` means that the lease was lost and nothing changed.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn finish(
        &self,
        claim: &Claim,
        ending: &Ending,
        now: i64,
    ) -> Result<Option<Job>, JobsError> {
        let (state, warnings, failure, key, patches) = match ending {
            Ending::Succeeded {
                warnings,
                result_key,
                field_patches,
            } => (
                State::Succeeded,
                to_json(warnings)?,
                None,
                Some(result_key),
                *field_patches,
            ),
            Ending::Failed(failure) => (
                State::Failed,
                "[]".to_owned(),
                Some(to_json(failure)?),
                None,
                0,
            ),
            Ending::Cancelled => (State::Cancelled, "[]".to_owned(), None, None, 0),
        };
        let row = sqlx::query(concat!(
            "UPDATE jobs SET state = $1, ended_at = $2, warnings = $3, failure = $4, result_key = $5, \
             field_patches = $6, progress = CASE WHEN $1 = 'succeeded' THEN 1.0 ELSE progress END, \
             lease_until = NULL, worker = NULL, version = version + 1 \
             WHERE id = $7 AND lease_number = $8 AND state = 'running' RETURNING ",
            job_columns!()
        ))
        .bind(state.name())
        .bind(now)
        .bind(warnings)
        .bind(failure)
        .bind(key)
        .bind(patches)
        .bind(claim.id.to_string())
        .bind(fence(claim))
        .fetch_optional(&self.writer)
        .await?;
        row.as_ref().map(read_job).transpose()
    }

    /// Hands a running job back to the queue without counting the attempt; a job whose cancellation was asked for
    /// ends as cancelled instead. Returns the new state, `None` if the lease was lost.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn release(&self, claim: &Claim, now: i64) -> Result<Option<State>, JobsError> {
        let row = sqlx::query(
            "UPDATE jobs SET state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
             ended_at = CASE WHEN cancel_requested = 1 THEN $1 ELSE NULL END, \
             started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
             attempt = attempt - 1, progress = 0, lease_until = NULL, worker = NULL, version = version + 1 \
             WHERE id = $2 AND lease_number = $3 AND state = 'running' RETURNING state",
        )
        .bind(now)
        .bind(claim.id.to_string())
        .bind(fence(claim))
        .fetch_optional(&self.writer)
        .await?;
        row.as_ref().map(read_state).transpose()
    }

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
}

/// The lease number in the form the database takes.
fn fence(claim: &Claim) -> i64 {
    i64::try_from(claim.lease_number).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn the_claim_and_the_reaper_find_their_jobs_by_index() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for statement in [CLAIM, REAP] {
            let steps = plan(&store, statement).await;
            assert!(
                steps
                    .iter()
                    .any(|step| step.contains("jobs_by_state (state=?)")),
                "{steps:?}"
            );
            assert!(
                !steps
                    .iter()
                    .any(|step| step.starts_with("SCAN") || step.contains("TEMP B-TREE")),
                "{steps:?}"
            );
        }
    }
}
