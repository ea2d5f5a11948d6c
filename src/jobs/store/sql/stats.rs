//! Statistics of the embedded job table: how many jobs, how old, how large; and what comes before a queued job.

use super::engine::{self, SqlStore, query, query_scalar};
use super::quota::stored;
use super::rows::{read_count, read_state};
use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::job::Job;
use crate::jobs::store::claim::QueueAhead;
use std::collections::{BTreeMap, HashSet};

use crate::jobs::model::job::State;
use crate::jobs::store::retention::{Stats, Usage};
use crate::jobs::store::{Claims, Statistics};
use crate::jobs::store_error::StoreError;

pub(crate) const COUNT: &str =
    "SELECT state, CAST(SUM(number) AS bigint) AS jobs FROM job_counts GROUP BY state";

/// Mean expected solve time of queued jobs in µs; of each tenant, of those that come first.
pub(crate) const MEAN_COST: &str = "SELECT CAST(COALESCE(SUM(number * mean) / SUM(number), 0) AS double precision) FROM (SELECT number, \
     (SELECT AVG(cost_us) FROM (SELECT cost_us FROM jobs WHERE state = 'queued' AND tenant = queued.tenant AND kind = queued.kind ORDER BY rank, id LIMIT 100) AS sampled) AS mean \
     FROM (SELECT tenant, kind, SUM(number) AS number FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0) AS queued) AS means";

/// When the oldest queued job was submitted: the first of each tenant and priority is looked at, however long their queues are. The
/// priority is no equation, so that only the index of the queue has the order that is asked for.
pub(crate) const OLDEST: &str = "SELECT MIN(first) FROM (SELECT (SELECT created_at FROM jobs \
     WHERE state = 'queued' AND tenant = queued.tenant AND kind = queued.kind AND rank >= ranks.rank AND rank <= ranks.rank ORDER BY rank, id LIMIT 1) AS first \
     FROM (SELECT tenant, kind FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0) AS queued, \
     (SELECT 0 AS rank UNION ALL SELECT 1 UNION ALL SELECT 2) AS ranks) AS firsts";

pub(crate) const RESULT_BYTES: &str =
    "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) FROM blobs WHERE key IS NOT NULL";

#[repeat_conflicts]
#[async_trait]
impl Statistics for SqlStore {
    async fn usage(&self, tenant: &str) -> Result<Usage, StoreError> {
        let rows = query("SELECT state, CAST(SUM(number) AS bigint) AS number FROM job_counts WHERE tenant = $1 GROUP BY state")
            .bind(tenant)
            .fetch_all(&self.readers)
            .await?;
        let mut usage = Usage::default();
        for row in &rows {
            usage
                .jobs
                .insert(read_state(row)?, read_count(row, "number")?);
        }
        let reserved = query(
            "SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) AS reserved FROM batches WHERE complete = 0 AND tenant = $1",
        );
        let reserved = reserved.bind(tenant);
        let row = reserved.fetch_one(&self.readers).await?;
        usage.reserved = read_count(&row, "reserved")?;
        usage.stored_bytes = stored(&mut *self.readers.acquire().await?, tenant).await?;
        Ok(usage)
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        let rows = query(COUNT).fetch_all(&self.readers).await?;
        let mut jobs: BTreeMap<State, u64> =
            State::ALL.into_iter().map(|state| (state, 0)).collect();
        for row in &rows {
            jobs.insert(read_state(row)?, read_count(row, "jobs")?);
        }
        let oldest_queued_at = query_scalar(OLDEST).fetch_one(&self.readers).await?;
        let mean_cost_us: f64 = query_scalar(MEAN_COST).fetch_one(&self.readers).await?;
        let result_bytes: i64 = query_scalar(RESULT_BYTES).fetch_one(&self.readers).await?;
        Ok(Stats {
            jobs,
            oldest_queued_at,
            mean_cost_us,
            database_bytes: self.database_bytes().await?,
            result_bytes: u64::try_from(result_bytes).unwrap_or(0),
        })
    }

    async fn queued_before(&self, job: &Job, limit: u32) -> Result<QueueAhead, StoreError> {
        let row = query(BEFORE)
            .bind(&job.tenant)
            .bind(job.priority.rank())
            .bind(job.id.to_string())
            .bind(i64::from(limit))
            .fetch_one(&self.readers)
            .await?;
        let queues = self.queues().await?;
        let tenants: HashSet<&str> = queues.iter().map(|(queue, _)| &*queue.tenant).collect();
        Ok(QueueAhead {
            jobs: read_count(&row, "jobs")?,
            cost_us: read_count(&row, "cost_us")?,
            tenants: tenants.len(),
        })
    }
}

/// Jobs of the tenant before one of this rank and id, and their expected µs; no further than the limit.
pub(crate) const BEFORE: &str = "SELECT COUNT(*) AS jobs, CAST(COALESCE(SUM(cost_us), 0) AS bigint) AS cost_us FROM (SELECT cost_us FROM jobs \
     WHERE state = 'queued' AND tenant = $1 AND kind = 'case' AND (rank, id) < ($2, $3) LIMIT $4) AS before";
