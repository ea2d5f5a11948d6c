//! Claims: the next group of queued jobs of a tenant.

use super::engine::{self, DbRow, QueryBuilder, Row, SqlStore, query};
use super::rows::{count, read_cache_key, read_count, read_flag, read_id, read_kind, read_small};
use std::sync::Arc;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::kind::Queue;
use crate::jobs::store::Claims;
use crate::jobs::store::claim::{Claim, ClaimRequest, Lease};
use crate::jobs::store_error::StoreError;

/// Selects the first jobs of the queue $1 and $5, at most `$most`; suspects if `$suspects` is 1.
macro_rules! peek {
    ($begun:literal, $most:literal, $suspects:literal) => {
        concat!(
            "SELECT id, suspect, cost_us, rank FROM jobs \
             WHERE state = 'queued' AND tenant = $1 AND kind = $5 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND suspect <= ", $suspects, " AND ",
            $begun,
            " AND (batch_id IS NULL OR batch_id NOT IN (SELECT id FROM batches WHERE complete = 0 AND tenant = $1)) \
             ORDER BY rank, id LIMIT ",
            $most,
            skip_locked!()
        )
    };
}

pub(crate) use peek;

/// The columns that a [`Claim`] is read from.
macro_rules! claimed {
    () => {
        "id, rank, attempt, lease_token, method, traceparent, suspect, slices, \
         CASE WHEN bypass_cache = 1 THEN NULL ELSE cache_key END AS cache_key"
    };
}
pub(crate) use claimed;

/// Queues with jobs in them.
pub(crate) const QUEUES: &str = "SELECT tenant, kind, CAST(SUM(number) AS bigint) AS waiting FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0 ORDER BY tenant, kind";

#[repeat_conflicts]
#[async_trait]
impl Claims for SqlStore {
    async fn queues(&self) -> Result<Vec<(Queue, u64)>, StoreError> {
        if let Some(known) = self.known_queues() {
            return Ok(known);
        }
        let mut connection = self.readers.acquire().await?;
        let rows = query(QUEUES).fetch_all(&mut *connection).await?;
        drop(connection);
        let read = |row: &DbRow| {
            let queue = Queue {
                tenant: row.try_get::<String, _>("tenant")?.into(),
                kind: read_kind(row)?,
            };
            Ok((queue, read_count(row, "waiting")?))
        };
        let queues = rows
            .iter()
            .map(read)
            .collect::<Result<Vec<_>, StoreError>>()?;
        self.remember_queues(&queues);
        Ok(queues)
    }

    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, StoreError> {
        let mut claims = Vec::with_capacity(request.jobs);
        for row in &self.claim_next(request, new_token()?).await? {
            let rank: i64 = row.try_get("rank")?;
            claims.push((rank, read_claim(row)?));
        }
        claims.sort_unstable_by_key(|(rank, claim)| (*rank, claim.id));
        Ok(claims.into_iter().map(|(_, claim)| claim).collect())
    }
}

/// A token that no other claim has: also a database that was set back in time does not give it out again.
fn new_token() -> Result<i64, StoreError> {
    let random = getrandom::u64().map_err(|error| StoreError::Failed(Arc::new(error)))?;
    Ok(count(random >> 1))
}

/// Writes when a lease that begins now runs out.
pub(crate) fn push_lease_until(query: &mut QueryBuilder, store: &SqlStore, lease: Lease) {
    query.push(engine::LEASE_NOW.0);
    query.push_bind(store.lease_now(lease.now));
    query.push(engine::LEASE_NOW.1).push(" + ");
    query.push_bind(lease.ms);
}

fn read_claim(row: &DbRow) -> Result<Claim, StoreError> {
    Ok(Claim {
        id: read_id(row)?,
        attempt: read_small(row, "attempt")?,
        lease_token: read_count(row, "lease_token")?,
        method: row.try_get("method")?,
        traceparent: row.try_get("traceparent")?,
        cache_key: read_cache_key(row)?,
        suspect: read_flag(row, "suspect")?,
        slices: read_small(row, "slices")?,
    })
}
