//! What workers ask of the embedded job table: claim, renew, hand back, and take from the dead. Always for a set of jobs.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use bytes::Bytes;
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, State};
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::{
    push_list, read_count, read_id, read_reuse_key, read_state, to_json,
};
use crate::jobs::store::{Claim, ClaimRequest, Release, Renewal, StoredCase, Which};

/// Queued jobs looked at in one claim, whatever the number of workers.
const PEEK_JOBS: i64 = 256;
/// Tenants with queued jobs: a row per tenant.
const QUEUED_TENANTS: &str =
    "SELECT tenant, number FROM job_counts WHERE state = 'queued' AND number > 0 ORDER BY tenant";
/// The queued jobs of a tenant that come first: by priority, the oldest of each first. Jobs whose deadline has passed are
/// left to whoever ends them.
const PEEK: &str = "SELECT id, suspect, cost_us FROM jobs \
     WHERE state = 'queued' AND tenant = $1 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND slices = 0 \
     ORDER BY rank, id LIMIT $2";
/// The same of those of which some slices are solved.
const PEEK_BEGUN: &str = "SELECT id, suspect, cost_us FROM jobs \
     WHERE state = 'queued' AND tenant = $1 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND slices > 0 \
     ORDER BY rank, id LIMIT $2";
/// Those whose worker is silent: single ones count the attempt, those of a group do not and come alone next time.
const REAP: &str = "UPDATE jobs SET \
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
const REAP_BYSTANDERS: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
     ended_at = CASE WHEN cancel_requested = 1 THEN $1 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
     attempt = attempt - 1, suspect = CASE WHEN solving = 1 THEN 1 ELSE suspect END, \
     progress = done, lease_until = NULL, worker = NULL, solving = 0, version = version + 1 \
     WHERE state = 'running' AND (solving = 0 OR group_size > 1 \
         OR (SELECT COUNT(*) FROM jobs AS other WHERE other.state = 'running' AND other.solving = 1) > 1) \
     RETURNING id, state";

impl SqliteStore {
    /// Tenants that have queued jobs.
    ///
    /// # Errors
    /// The database failed.
    pub async fn queued_tenants(&self) -> Result<Vec<Arc<str>>, JobsError> {
        let rows = sqlx::query(QUEUED_TENANTS).fetch_all(&self.readers).await?;
        rows.iter()
            .map(|row| Ok(row.try_get::<String, _>("tenant")?.into()))
            .collect()
    }

    /// Claims the first queued job of a tenant together with those behind it that are as small, in their order: by
    /// priority, then by age. A suspect comes alone.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, JobsError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let (peek, at_most) = match request.which {
            Which::New => (PEEK, PEEK_JOBS),
            Which::Begun => (PEEK_BEGUN, 1),
        };
        let peek = match request.skip.is_empty() {
            true => peek.to_owned(),
            false => peek.replace(
                " ORDER BY",
                &format!(" AND {} ORDER BY", none_of(request.skip)),
            ),
        };
        let each = request.each_slice_us.unwrap_or(u64::MAX);
        let queued = sqlx::query(AssertSqlSafe(peek))
            .bind(request.tenant)
            .bind(at_most)
            .bind(request.late_before)
            .bind(i64::try_from(each).unwrap_or(i64::MAX))
            .fetch_all(&mut *transaction)
            .await?;
        if queued.is_empty() {
            return Ok(Vec::new());
        }
        let waiting: i64 = sqlx::query_scalar(
            "SELECT COALESCE(SUM(number), 0) FROM job_counts WHERE state = 'queued' AND tenant = $1",
        )
        .bind(request.tenant)
        .fetch_one(&mut *transaction)
        .await?;
        let ids = choose(&queued, usize::try_from(waiting).unwrap_or(0), request)?;
        let mut update = QueryBuilder::<Sqlite>::new(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_number = lease_number + 1, lease_until = ",
        );
        update.push_bind(request.lease_until);
        update.push(", worker = ").push_bind(request.worker);
        update.push(", started_at = ").push_bind(request.now);
        update.push(", group_size = ");
        update.push_bind(i64::try_from(ids.len()).unwrap_or(i64::MAX));
        // A suspect has to wait until nothing else is solved.
        update.push(", solving = 1 - suspect, progress = done, version = version + 1 WHERE state = 'queued' AND id IN (");
        push_list(&mut update, &ids);
        update.push(
            ") RETURNING id, attempt, lease_number, method, traceparent, suspect, slices, \
             CASE WHEN fresh = 1 THEN NULL ELSE reuse_key END AS reuse_key",
        );
        let rows = update.build().fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        let mut claims = rows.iter().map(read_claim).collect::<Result<Vec<_>, _>>()?;
        let places: HashMap<_, _> = ids.iter().zip(0..).collect();
        claims.sort_unstable_by_key(|claim| places.get(&claim.id).copied().unwrap_or(usize::MAX));
        Ok(claims)
    }

    /// The cases of jobs, and whether their cancellation was asked for. A template is read once, however many rows fill it.
    ///
    /// # Errors
    /// The database failed.
    pub async fn cases(
        &self,
        ids: &[Uuid],
    ) -> Result<HashMap<Uuid, (StoredCase, bool)>, JobsError> {
        let mut query = QueryBuilder::<Sqlite>::new(
            "SELECT id, row, body, batch_id, cancel_requested FROM cases JOIN jobs ON jobs.id = cases.job_id \
             WHERE job_id IN (",
        );
        push_list(&mut query, ids);
        query.push(")");
        let rows = query.build().fetch_all(&self.readers).await?;
        let mut templates: HashMap<String, Bytes> = HashMap::new();
        let mut cases = HashMap::with_capacity(rows.len());
        for row in &rows {
            let mut template = None;
            if row.try_get("row")? {
                let batch: String = row.try_get("batch_id")?;
                if !templates.contains_key(&batch) {
                    templates.insert(batch.clone(), self.template(&batch).await?);
                }
                template = templates.get(&batch).cloned();
            }
            let body: Vec<u8> = row.try_get("body")?;
            let case = StoredCase {
                template,
                body: body.into(),
            };
            cases.insert(read_id(row)?, (case, row.try_get("cancel_requested")?));
        }
        Ok(cases)
    }

    async fn template(&self, batch: &str) -> Result<Bytes, JobsError> {
        let body: Option<Vec<u8>> =
            sqlx::query_scalar("SELECT body FROM batch_templates WHERE batch_id = $1")
                .bind(batch)
                .fetch_optional(&self.readers)
                .await?;
        // It goes with the last job of its batch.
        body.map(Bytes::from).ok_or(JobsError::Expired)
    }

    /// Extends leases and notes the progress. The answers are in the order of the claims.
    ///
    /// # Errors
    /// The database failed; the leases stand as they were.
    pub async fn renew(
        &self,
        claims: &[(&Claim, f64)],
        lease_until: i64,
    ) -> Result<Vec<Renewal>, JobsError> {
        let mut query = QueryBuilder::<Sqlite>::new("WITH held (id, lease_number, now_at) AS (");
        query.push_values(claims, |mut row, (claim, progress)| {
            row.push_bind(claim.id.to_string())
                .push_bind(fence(claim))
                .push_bind(*progress);
        });
        query.push(") UPDATE jobs SET lease_until = ");
        query.push_bind(lease_until);
        query.push(
            ", progress = MAX(held.now_at, done), \
             version = CASE WHEN progress = MAX(held.now_at, done) THEN version ELSE version + 1 END",
        );
        query.push(OF_HELD).push("jobs.id AS id, cancel_requested");
        let rows = query.build().fetch_all(&self.writer).await?;
        let mut held = HashMap::with_capacity(rows.len());
        for row in &rows {
            held.insert(read_id(row)?, row.try_get("cancel_requested")?);
        }
        let answers = claims.iter().map(|(claim, _)| match held.get(&claim.id) {
            Some(cancel_requested) => Renewal::Held {
                cancel_requested: *cancel_requested,
            },
            None => Renewal::Lost,
        });
        Ok(answers.collect())
    }

    /// Notes that claimed jobs are being solved, or that they wait for their turn, each by itself from now on.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn set_solving(&self, claims: &[Claim], solving: bool) -> Result<(), JobsError> {
        if claims.is_empty() {
            return Ok(());
        }
        let mut query = with_held(claims);
        query.push(" UPDATE jobs SET group_size = 1, solving = ");
        query.push_bind(solving);
        query.push(OF_HELD).push("jobs.id AS id");
        query.build().execute(&self.writer).await?;
        Ok(())
    }

    /// Hands running jobs back to the queue without counting their attempts; those whose cancellation was asked for end as
    /// cancelled instead. Returns those that were still held, with their new states.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn release(
        &self,
        claims: &[Claim],
        why: Release,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = with_held(claims);
        query.push(
            " UPDATE jobs SET state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
             started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
             attempt = attempt - 1, progress = done, lease_until = NULL, worker = NULL, solving = 0, \
             version = version + 1",
        );
        match why {
            Release::NotBegun => {}
            Release::SolveItself => drop(query.push(", fresh = 1")),
            Release::Long { slice_us } => {
                let slice_us = i64::try_from(slice_us).unwrap_or(i64::MAX);
                query
                    .push(", slice_us = MAX(slice_us, ")
                    .push_bind(slice_us);
                query.push("), cost_us = MAX(cost_us, ").push_bind(slice_us);
                query.push(")");
            }
        }
        query.push(", ended_at = CASE WHEN cancel_requested = 1 THEN ");
        query.push_bind(now);
        query
            .push(" ELSE NULL END")
            .push(OF_HELD)
            .push("jobs.id AS id, state");
        let rows = query.build().fetch_all(&self.writer).await?;
        rows.iter()
            .map(|row| Ok((read_id(row)?, read_state(row)?)))
            .collect()
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

/// The ids of the next group among the first queued jobs of a tenant that has so many waiting.
fn choose(
    queued: &[SqliteRow],
    waiting: usize,
    request: &ClaimRequest<'_>,
) -> Result<Vec<Uuid>, JobsError> {
    let share = waiting
        .max(queued.len())
        .div_ceil(request.workers.max(1))
        .min(request.jobs)
        .min(queued.len());
    let mut ids = Vec::with_capacity(share);
    let mut cost_us = 0;
    for row in &queued[..share] {
        let suspect: bool = row.try_get("suspect")?;
        cost_us += read_count(row, "cost_us")?;
        if !ids.is_empty() && (suspect || cost_us > request.cost_us) {
            break;
        }
        ids.push(read_id(row)?);
        if suspect {
            break;
        }
    }
    Ok(ids)
}

fn read_claim(row: &SqliteRow) -> Result<Claim, JobsError> {
    Ok(Claim {
        id: read_id(row)?,
        attempt: row.try_get("attempt")?,
        lease_number: read_count(row, "lease_number")?,
        method: row.try_get("method")?,
        traceparent: row.try_get("traceparent")?,
        reuse_key: read_reuse_key(row)?,
        suspect: row.try_get("suspect")?,
        slices: row.try_get("slices")?,
    })
}

/// Of no batch among these. Ids are hexadecimal digits and dashes and need no escaping.
fn none_of(batches: &HashSet<Uuid>) -> String {
    let ids: Vec<_> = batches.iter().map(|id| format!("'{id}'")).collect();
    format!("(batch_id IS NULL OR batch_id NOT IN ({}))", ids.join(", "))
}

/// The end of an update of claimed jobs, as long as their leases are held.
const OF_HELD: &str = " FROM held WHERE jobs.id = held.id AND jobs.lease_number = held.lease_number \
     AND jobs.state = 'running' RETURNING ";

fn with_held(claims: &[Claim]) -> QueryBuilder<Sqlite> {
    let mut query = QueryBuilder::new("WITH held (id, lease_number) AS (");
    query.push_values(claims, |mut row, claim| {
        row.push_bind(claim.id.to_string()).push_bind(fence(claim));
    });
    query.push(")");
    query
}

/// The lease number in the form the database takes.
pub(super) fn fence(claim: &Claim) -> i64 {
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
        let bystanders = REAP_BYSTANDERS;
        for (statement, seek) in [
            (QUEUED_TENANTS, "PRIMARY KEY (state=?"),
            (PEEK, "jobs_queued (tenant=?"),
            (PEEK_BEGUN, "jobs_begun (tenant=?"),
            (REAP, "jobs_by_state (state=?"),
            (bystanders, "jobs_by_state (state=?"),
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
