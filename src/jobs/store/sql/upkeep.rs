//! Expired leases, deadlines, expired jobs, and statistics.
use std::collections::{BTreeMap, HashSet};

use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, SqlStore, query, query_scalar};
use super::rows::{read_blob_ids, read_count, read_id, read_move, read_state, to_json};
use crate::model::{Failure, Job, State};
use crate::store::{
    Claims, Moment, Overdue, QueueAhead, Reap, Result, RetentionRule, Stats, Usage, first_id_at,
};

/// Takes jobs with expired leases from their workers. The attempt counts for a job that was claimed alone; jobs of a group are
/// claimed alone next time.
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

/// Marks the running jobs of a crashed process as a group, because none of them can be identified as its cause. A job that was a
/// suspect, or the only running job, is the cause.
pub(crate) const GROUP_RUNNING: &str = "UPDATE jobs SET group_size = 2 WHERE state = 'running' AND suspect = 0 AND group_size = 1 \
     AND (SELECT COUNT(*) FROM jobs AS other WHERE other.state = 'running') > 1";

/// Maintenance: expired leases, deadlines, expired jobs, and statistics.
#[store_trait]
impl Upkeep for SqlStore {
    /// Takes running jobs from their workers: to `cancelled` if they were cancelled, to `failed` if `attempts_max` is
    /// reached, else back to the queue. The attempt counts only for a job that was claimed alone; the others are claimed
    /// alone next time. Returns them with their new states.
    async fn reap(&self, which: Reap, now: i64, attempts_max: u32) -> Result<Vec<(Uuid, State)>> {
        let mut transaction = engine::begin(&self.writer).await?;
        let late = match which {
            Reap::Expired { now } => self.lease_now(now),
            Reap::Dead => {
                sql!(execute, &mut *transaction, GROUP_RUNNING)?;
                Some(i64::MAX)
            }
        };
        let rows = sql!(fetch_all, &mut *transaction,
            REAP;
            i64::from(attempts_max), to_json(&Failure::worker_lost(attempts_max))?, now, late
        )?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        self.requeued();
        rows.iter()
            .map(|row| read_move(row, State::Running))
            .collect()
    }

    /// Ends some of the queued jobs whose deadline has passed, and finds the running ones. To be called until it ends none.
    async fn pass_deadlines(&self, failure: &Failure, moment: Moment) -> Result<Overdue> {
        // Late jobs are rare, and a read does not block writers.
        let rows = sql!(fetch_all, &self.readers, LATE; moment.now, moment.set_at, moment.unset)?;
        let (mut queued, mut overdue) = (false, Overdue::default());
        for row in &rows {
            match read_state(row)? {
                State::Queued => queued = true,
                _ => overdue.running.push(read_id(row)?),
            }
        }
        if queued {
            let mut transaction = engine::begin(&self.writer).await?;
            let late = sql!(fetch_all, &mut *transaction,
                FAIL_LATE;
                moment.now, moment.set_at, moment.unset, to_json(failure)?, AT_ONCE
            )?;
            drop_slices_of_ended(&mut transaction, &late).await?;
            transaction.commit().await?;
            let ended = late.iter().map(|row| Ok(read_move(row, State::Queued)?.0));
            overdue.ended = ended.collect::<Result<_>>()?;
        }
        Ok(overdue)
    }

    /// Removes expired jobs and leaves tombstones; removes empty batches of the same age, and old tombstones. Returns the
    /// number of jobs removed.
    async fn expire(&self, expiry: RetentionRule) -> Result<u64> {
        let mut transaction = engine::begin(&self.writer).await?;
        let young = first_id_at(expiry.ended_before.saturating_add(1)).to_string();
        let rows = sql!(fetch_all, &mut *transaction,
            EXPIRED;
            &young, expiry.ended_before, i64::from(expiry.jobs)
        )?;
        let ids = rows.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
        let ids = to_json(&ids)?;
        sql!(execute, &mut *transaction,
            concat!(
                "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, $1 FROM jobs WHERE id",
                in_list!("$2"),
                " ON CONFLICT (id) DO NOTHING"
            );
            expiry.now, &ids
        )?;
        sql!(execute, &mut *transaction,
            concat!("DELETE FROM jobs WHERE id", in_list!("$1"));
            &ids
        )?;
        release_blobs(&mut transaction, read_blob_ids(&rows)?).await?;
        sql!(execute, &mut *transaction,
            "INSERT INTO tombstones (id, tenant, gone_at) SELECT id, tenant, $1 FROM batches \
             WHERE id < $2 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id) \
             ON CONFLICT (id) DO NOTHING";
            expiry.now, &young
        )?;
        sql!(execute, &mut *transaction,
            "DELETE FROM batches \
             WHERE id < $1 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)";
            &young
        )?;
        sql!(execute, &mut *transaction,
            "DELETE FROM tombstones WHERE id < $1 AND gone_at <= $2";
            first_id_at(expiry.forget_before.saturating_add(1)).to_string(), expiry.forget_before
        )?;
        transaction.commit().await?;
        Ok(rows.len() as u64)
    }

    /// Whether a job or batch of this tenant with this id has expired.
    async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool> {
        let found = sql!(fetch_optional, &self.readers,
            "SELECT 1 FROM tombstones WHERE id = $1 AND tenant = $2";
            id.to_string(), tenant
        )?;
        Ok(found.is_some())
    }

    /// Usage of a tenant, without staged bytes.
    async fn usage(&self, tenant: &str) -> Result<Usage> {
        let rows = sql!(fetch_all, &self.readers,
            "SELECT state, CAST(SUM(number) AS bigint) AS number FROM job_counts WHERE tenant = $1 GROUP BY state";
            tenant
        )?;
        let mut usage = Usage::default();
        for row in &rows {
            usage
                .jobs
                .insert(read_state(row)?, read_count(row, "number")?);
        }
        let row = sql!(fetch_one, &self.readers,
            "SELECT (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0 AND tenant = $1) AS reserved, \
             (SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) FROM stored_bytes WHERE tenant = $1) AS stored";
            tenant
        )?;
        usage.reserved = read_count(&row, "reserved")?;
        usage.stored_bytes = read_count(&row, "stored")?;
        Ok(usage)
    }

    /// Counts and sizes, which are read from indices.
    async fn stats(&self) -> Result<Stats> {
        let rows = sql!(fetch_all, &self.readers, COUNT)?;
        let mut jobs: BTreeMap<State, u64> =
            State::ALL.into_iter().map(|state| (state, 0)).collect();
        for row in &rows {
            jobs.insert(read_state(row)?, read_count(row, "jobs")?);
        }
        let oldest_queued_at = sql!(scalar fetch_one, &self.readers, OLDEST)?;
        let mean_cost_us: f64 = sql!(scalar fetch_one, &self.readers, MEAN_COST)?;
        let result_bytes: i64 = sql!(scalar fetch_one, &self.readers, RESULT_BYTES)?;
        Ok(Stats {
            jobs,
            oldest_queued_at,
            mean_cost_us,
            database_bytes: self.database_bytes().await?,
            result_bytes: u64::try_from(result_bytes).unwrap_or(0),
        })
    }

    /// Counts the jobs of the same tenant before a queued job, at most `limit`.
    async fn queued_before(&self, job: &Job, limit: u32) -> Result<QueueAhead> {
        let row = sql!(fetch_one, &self.readers,
            BEFORE;
            &job.tenant, job.priority.rank(), job.id.to_string(), i64::from(limit)
        )?;
        let queues = self.queues().await?;
        let tenants: HashSet<&str> = queues.iter().map(|(queue, _)| &*queue.tenant).collect();
        Ok(QueueAhead {
            jobs: read_count(&row, "jobs")?,
            cost_us: read_count(&row, "cost_us")?,
            tenants: tenants.len(),
        })
    }
}

/// Jobs whose deadline is before $1; jobs submitted before $2 only if it is also before $3.
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

/// Number of jobs ended in one transaction, which locks their rows. Chosen by judgement: some tens of milliseconds.
const AT_ONCE: i64 = 1000;

/// Expired jobs. Ids increase with the time of submission, so that only the oldest rows are read. Chunks of a run expire together
/// after the last of them.
pub(crate) const EXPIRED: &str = concat!(
    "SELECT id, blob_id FROM jobs \
     WHERE id < $1 AND ended_at <= $2 \
     AND (batch_id IS NULL OR kind = 'case' \
     OR NOT EXISTS (SELECT 1 FROM batches WHERE batches.id = jobs.batch_id AND batches.ended_at > $2) \
     AND NOT EXISTS (SELECT 1 FROM jobs AS beside WHERE beside.batch_id = jobs.batch_id AND beside.state IN ('queued', 'running'))) \
     ORDER BY id LIMIT $3",
    skip_locked!()
);

pub(crate) const COUNT: &str =
    "SELECT state, CAST(SUM(number) AS bigint) AS jobs FROM job_counts GROUP BY state";

/// Mean expected solve time of queued jobs in µs, from the first jobs of each queue.
pub(crate) const MEAN_COST: &str = "SELECT CAST(COALESCE(SUM(number * mean) / SUM(number), 0) AS double precision) FROM (SELECT number, \
     (SELECT AVG(cost_us) FROM (SELECT cost_us FROM jobs WHERE state = 'queued' AND tenant = queued.tenant AND kind = queued.kind ORDER BY rank, id LIMIT 100) AS sampled) AS mean \
     FROM (SELECT tenant, kind, SUM(number) AS number FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0) AS queued) AS means";

/// Time of submission of the oldest queued job: the first job of each queue and priority is read. The priority is not compared by an
/// equation, so that only the index of the queue has the requested order.
pub(crate) const OLDEST: &str = "SELECT MIN(first) FROM (SELECT (SELECT created_at FROM jobs \
     WHERE state = 'queued' AND tenant = queued.tenant AND kind = queued.kind AND rank >= ranks.rank AND rank <= ranks.rank ORDER BY rank, id LIMIT 1) AS first \
     FROM (SELECT tenant, kind FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0) AS queued, \
     (SELECT 0 AS rank UNION ALL SELECT 1 UNION ALL SELECT 2) AS ranks) AS firsts";

pub(crate) const RESULT_BYTES: &str =
    "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) FROM blobs WHERE key IS NOT NULL";

/// Number of jobs of the tenant before this rank and id, at most the limit, and the sum of their expected solve times in µs.
pub(crate) const BEFORE: &str = "SELECT COUNT(*) AS jobs, CAST(COALESCE(SUM(cost_us), 0) AS bigint) AS cost_us FROM (SELECT cost_us FROM jobs \
     WHERE state = 'queued' AND tenant = $1 AND kind = 'case' AND (rank, id) < ($2, $3) LIMIT $4) AS before";
