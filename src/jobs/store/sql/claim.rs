//! Claims: the next group of queued jobs of a tenant.

use super::engine::{self, Db, DbConnection, DbRow, SqlStore};
use super::rows::{
    count, push_list, read_cache_key, read_count, read_flag, read_id, read_kind, read_small,
};
use sqlx::{QueryBuilder, Row};
use std::collections::HashMap;
use std::sync::Arc;

use uuid::Uuid;

use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::{Claim, ClaimKind, ClaimRequest, Lease};
use crate::jobs::store_error::StoreError;

macro_rules! peek {
    ($begun:literal) => {
        concat!(
            "SELECT id, suspect, cost_us, rank FROM jobs \
             WHERE state = 'queued' AND tenant = $1 AND kind = $5 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND ",
            $begun,
            " AND (batch_id IS NULL OR batch_id NOT IN (SELECT id FROM batches WHERE complete = 0 AND tenant = $1)) \
             ORDER BY rank, id LIMIT $2",
            skip_locked!()
        )
    };
}

/// Queues with jobs in them.
pub(crate) const QUEUES: &str = "SELECT tenant, kind FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0 ORDER BY tenant, kind";

/// The jobs of a queue that come first: by priority, the oldest of each first. Jobs whose deadline has passed are
/// left to whoever ends them, jobs of a batch that is not acknowledged to whoever fills it.
pub(crate) const PEEK: &str = peek!("slices = 0");

/// The same of those of which some slices are solved.
pub(crate) const PEEK_BEGUN: &str = peek!("slices > 0");

/// Jobs in a queue.
pub(crate) const WAITING: &str = "SELECT CAST(COALESCE(SUM(number), 0) AS bigint) AS number FROM job_counts \
     WHERE state = 'queued' AND tenant = $1 AND kind = $2";

impl SqlStore {
    /// Queues with jobs in them.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn queues(&self) -> Result<Vec<Queue>, StoreError> {
        if let Some(known) = self.known_queues() {
            return Ok(known);
        }
        let rows = sqlx::query(QUEUES).fetch_all(&self.readers).await?;
        let read = |row: &DbRow| {
            Ok(Queue {
                tenant: row.try_get::<String, _>("tenant")?.into(),
                kind: read_kind(row)?,
            })
        };
        let queues = rows
            .iter()
            .map(read)
            .collect::<Result<Vec<_>, StoreError>>()?;
        self.remember_queues(&queues);
        Ok(queues)
    }

    /// Claims the first job of a queue together with those behind it that are as small, in their order: by
    /// priority, then by age. A suspect comes alone.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub(crate) async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        let queued = match request.kind {
            ClaimKind::New => {
                let most = self.share(&mut transaction, request).await?;
                self.peek(&mut transaction, request, most).await?
            }
            ClaimKind::Begun => first_queued(&mut transaction, PEEK_BEGUN, request, 1).await?,
        };
        if queued.is_empty() {
            return Ok(Vec::new());
        }
        let ids = choose(&queued, request)?;
        let mut update = QueryBuilder::<Db>::new(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_token = ",
        );
        update.push_bind(new_token()?).push(", lease_until = ");
        push_lease_until(&mut update, self, request.lease);
        update.push(", worker = ").push_bind(request.worker);
        update.push(", started_at = ").push_bind(request.now);
        update.push(", updated_at = ").push_bind(request.now);
        update.push(", group_size = ");
        update.push_bind(count(ids.len()));
        // A suspect has to wait until nothing else is solved.
        update.push(", solving = 1 - suspect, progress = done, version = version + 1 WHERE state = 'queued' AND id IN (");
        push_list(&mut update, &ids);
        update.push(
            ") RETURNING id, attempt, lease_token, method, traceparent, suspect, slices, \
             CASE WHEN bypass_cache = 1 THEN NULL ELSE cache_key END AS cache_key",
        );
        let rows = update.build().fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        let mut claims = rows.iter().map(read_claim).collect::<Result<Vec<_>, _>>()?;
        let places: HashMap<_, _> = ids.iter().zip(0..).collect();
        claims.sort_unstable_by_key(|claim| places.get(&claim.id).copied().unwrap_or(usize::MAX));
        Ok(claims)
    }

    /// Most jobs of one claim, so that each worker gets some of a short queue.
    async fn share(
        &self,
        connection: &mut DbConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<i64, StoreError> {
        let waiting = self.waiting(connection, request.queue).await?;
        let waiting = usize::try_from(waiting).unwrap_or(0);
        let share = waiting.div_ceil(request.workers.max(1));
        Ok(count(share.min(request.jobs).max(1)))
    }
}

/// The first jobs of a queue, found by a statement from its start.
pub(crate) async fn first_queued(
    connection: &mut DbConnection,
    peek: &'static str,
    request: &ClaimRequest<'_>,
    most: i64,
) -> Result<Vec<DbRow>, StoreError> {
    let rows = sqlx::query(peek)
        .bind(&*request.queue.tenant)
        .bind(most)
        .bind(request.late_before)
        .bind(request.each_slice_us.map_or(i64::MAX, count))
        .bind(request.queue.kind.name())
        .fetch_all(connection)
        .await?;
    Ok(rows)
}

/// Jobs in a queue.
pub(crate) async fn count_waiting(
    connection: &mut DbConnection,
    queue: &Queue,
) -> Result<i64, StoreError> {
    let row = sqlx::query(WAITING)
        .bind(&*queue.tenant)
        .bind(queue.kind.name())
        .fetch_one(connection)
        .await?;
    Ok(count(read_count(&row, "number")?))
}

/// The ids of the next group: the first of the queued jobs together with those behind it that are small enough.
fn choose(queued: &[DbRow], request: &ClaimRequest<'_>) -> Result<Vec<Uuid>, StoreError> {
    let mut ids = Vec::with_capacity(queued.len());
    let mut cost_us = 0;
    for row in queued {
        let suspect = read_flag(row, "suspect")?;
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

/// A token that no other claim has: also a database that was set back in time does not give it out again.
fn new_token() -> Result<i64, StoreError> {
    let random = getrandom::u64().map_err(|error| StoreError::Failed(Arc::new(error)))?;
    Ok(count(random >> 1))
}

/// Writes when a lease that begins now runs out.
pub(crate) fn push_lease_until(query: &mut QueryBuilder<Db>, store: &SqlStore, lease: Lease) {
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
