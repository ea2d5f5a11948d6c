//! What ends or goes by itself: leases that run out, deadlines that pass, jobs that expire.

use super::blob_refs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, QueryBuilder, SqlStore, query};
use super::rows::{push_list, read_blob_ids, read_id, read_move, read_state, to_json};
use uuid::Uuid;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::job::{Failure, State};
use crate::jobs::store::Upkeep;
use crate::jobs::store::claim::Reap;
use crate::jobs::store::list::first_id_at;
use crate::jobs::store::retention::{Moment, Overdue, RetentionRule};
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
     progress = done, lease_until = NULL, worker = NULL, version = version + 1, updated_at = $3 \
     WHERE state = 'running' AND lease_until <= ",
    lease_now!("$4"),
    " RETURNING id, state, slices"
);

/// Returns the jobs of a dead process that may not have caused its death to the queue: the attempt does not count, and each is claimed alone next time.
/// The remaining job was the only suspect, or the only one that was running.
pub(crate) const REAP_BYSTANDERS: &str = "UPDATE jobs SET \
     state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
     ended_at = CASE WHEN cancel_requested = 1 THEN $1 ELSE NULL END, \
     started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
     attempt = attempt - 1, suspect = 1, \
     progress = done, lease_until = NULL, worker = NULL, version = version + 1, updated_at = $1 \
     WHERE state = 'running' AND (group_size > 1 \
         OR (suspect = 0 AND (SELECT COUNT(*) FROM jobs AS other WHERE other.state = 'running') > 1)) \
     RETURNING id, state, slices";

#[repeat_conflicts]
#[async_trait]
impl Upkeep for SqlStore {
    async fn reap(
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
                let bystanders = query(REAP_BYSTANDERS).bind(now);
                rows = bystanders.fetch_all(&mut *transaction).await?;
                Some(i64::MAX)
            }
        };
        let expired = query(REAP)
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

    async fn pass_deadlines(
        &self,
        failure: &Failure,
        moment: Moment,
    ) -> Result<Overdue, StoreError> {
        // Late jobs are rare, and a read holds no writer up.
        let rows = query(LATE)
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

    async fn expire(&self, expiry: RetentionRule) -> Result<u64, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let young = first_id_at(expiry.ended_before.saturating_add(1)).to_string();
        let rows = query(EXPIRED)
            .bind(&young)
            .bind(expiry.ended_before)
            .bind(i64::from(expiry.jobs))
            .fetch_all(&mut *transaction)
            .await?;
        let mut blobs = Vec::with_capacity(rows.len());
        for some in rows.chunks(250) {
            let ids = some.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
            blobs.extend(read_blob_ids(some)?);
            let mut bury = QueryBuilder::new(
                "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, ",
            );
            bury.push_bind(expiry.now);
            bury.push(" FROM jobs WHERE id IN (");
            push_list(&mut bury, &ids);
            bury.push(") ON CONFLICT (id) DO NOTHING");
            bury.build().execute(&mut *transaction).await?;
            let mut delete = QueryBuilder::new("DELETE FROM jobs WHERE id IN (");
            push_list(&mut delete, &ids);
            delete.push(")");
            delete.build().execute(&mut *transaction).await?;
        }
        release_blobs(&mut transaction, blobs).await?;
        query(
            "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, $1 FROM batches \
             WHERE id < $2 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id) \
             ON CONFLICT (id) DO NOTHING",
        )
        .bind(expiry.now)
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        query(
            "DELETE FROM batches \
             WHERE id < $1 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)",
        )
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        query("DELETE FROM tombstones WHERE id < $1 AND gone_at <= $2")
            .bind(first_id_at(expiry.forget_before.saturating_add(1)).to_string())
            .bind(expiry.forget_before)
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(rows.len() as u64)
    }

    async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool, StoreError> {
        let found = query("SELECT 1 FROM tombstones WHERE id = $1 AND tenant = $2")
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        Ok(found.is_some())
    }
}

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
    async fn fail_late(&self, failure: &Failure, moment: Moment) -> Result<Vec<Uuid>, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = query(FAIL_LATE)
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

/// Ids grow with the time of submission, so that only the oldest rows are read. Chunks of a run expire with the last of
/// them.
pub(crate) const EXPIRED: &str = concat!(
    "SELECT id, blob_id FROM jobs \
     WHERE id < $1 AND ended_at <= $2 \
     AND (batch_id IS NULL OR kind = 'case' \
     OR NOT EXISTS (SELECT 1 FROM batches WHERE batches.id = jobs.batch_id AND batches.ended_at > $2) \
     AND NOT EXISTS (SELECT 1 FROM jobs AS beside WHERE beside.batch_id = jobs.batch_id AND beside.state IN ('queued', 'running'))) \
     ORDER BY id LIMIT $3",
    skip_locked!()
);
