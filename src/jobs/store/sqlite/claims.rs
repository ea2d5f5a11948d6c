//! What workers ask of the embedded job table: claim, renew, finish, hand back, and take from the dead.

use std::collections::HashSet;

use sqlx::{QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, Job, State};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::groups::push_list;
use crate::jobs::store::sqlite::rows::{read_id, read_state, to_json};
use crate::jobs::store::{Claim, Ending, Placed, Renewal};

const REAP: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' \
         WHEN group_size = 1 AND attempt >= $1 THEN 'failed' ELSE 'queued' END, \
     failure = CASE WHEN cancel_requested = 0 AND group_size = 1 AND attempt >= $1 THEN $2 ELSE NULL END, \
     ended_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN $3 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 OR (group_size = 1 AND attempt >= $1) THEN started_at ELSE NULL END, \
     attempt = CASE WHEN group_size > 1 THEN attempt - 1 ELSE attempt END, \
     alone = CASE WHEN group_size > 1 THEN 1 ELSE alone END, \
     progress = 0, lease_until = NULL, worker = NULL, version = version + 1 \
     WHERE state = 'running' AND lease_until <= $4 RETURNING id, state";

impl SqliteStore {
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
        let ended = self
            .finish_group(&[(claim.clone(), ending.clone())], now)
            .await?;
        if ended.is_empty() {
            return Ok(None);
        }
        self.get(claim.id).await
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

    /// Those of these jobs that are running.
    ///
    /// # Errors
    /// The database failed.
    pub async fn running(&self, ids: &[Uuid]) -> Result<HashSet<Uuid>, JobsError> {
        let mut query =
            QueryBuilder::<Sqlite>::new("SELECT id FROM jobs WHERE state = 'running' AND id IN (");
        push_list(&mut query, ids);
        query.push(")");
        let rows = query.build().fetch_all(&self.readers).await?;
        rows.iter().map(read_id).collect()
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

/// The end of a job in the form the database takes.
pub(super) struct EndRow<'a> {
    pub(super) state: State,
    pub(super) remarks: String,
    pub(super) failure: Option<String>,
    pub(super) field_patches: u32,
    pub(super) result: Option<&'a Placed>,
}

impl EndRow<'_> {
    pub(super) fn of(ending: &Ending) -> Result<EndRow<'_>, JobsError> {
        let mut row = EndRow {
            state: State::Cancelled,
            remarks: "[]".to_owned(),
            failure: None,
            field_patches: 0,
            result: None,
        };
        match ending {
            Ending::Succeeded {
                remarks,
                result,
                field_patches,
            } => {
                row.state = State::Succeeded;
                row.remarks = to_json(remarks)?;
                row.field_patches = *field_patches;
                row.result = Some(result);
            }
            Ending::Failed(failure) => {
                row.state = State::Failed;
                row.failure = Some(to_json(failure)?);
            }
            Ending::Cancelled => {}
        }
        Ok(row)
    }
}

/// The lease number in the form the database takes.
pub(super) fn fence(claim: &Claim) -> i64 {
    i64::try_from(claim.lease_number).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::groups::{NEXT_TENANT, PEEK};
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn the_claim_and_the_reaper_find_their_jobs_by_index() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for (statement, seek) in [
            (NEXT_TENANT, "jobs_by_state (state=? AND tenant>?"),
            (PEEK, "jobs_queued (tenant=?"),
            (REAP, "jobs_by_state (state=?"),
        ] {
            let steps = plan(&store, statement).await;
            assert!(steps.iter().any(|step| step.contains(seek)), "{steps:?}");
            assert!(
                !steps
                    .iter()
                    .any(|step| step.starts_with("SCAN") || step.contains("TEMP B-TREE")),
                "{steps:?}"
            );
        }
    }
}
