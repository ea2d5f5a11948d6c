//! Claims: the next group of queued jobs of a tenant.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::store::claim::{Claim, ClaimKind, ClaimRequest};
use crate::jobs::store::error::StoreError;
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{push_list, read_cache_key, read_count, read_id};

/// Queued jobs read in one claim, whatever the number of workers.
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

impl SqliteStore {
    /// Tenants that have queued jobs.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn queued_tenants(&self) -> Result<Vec<Arc<str>>, StoreError> {
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
    pub(crate) async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, StoreError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let (peek, at_most) = match request.kind {
            ClaimKind::New => (PEEK, PEEK_JOBS),
            ClaimKind::Begun => (PEEK_BEGUN, 1),
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
        update.push(", updated_at = ").push_bind(request.now);
        update.push(", group_size = ");
        update.push_bind(i64::try_from(ids.len()).unwrap_or(i64::MAX));
        // A suspect has to wait until nothing else is solved.
        update.push(", solving = 1 - suspect, progress = done, version = version + 1 WHERE state = 'queued' AND id IN (");
        push_list(&mut update, &ids);
        update.push(
            ") RETURNING id, attempt, lease_number, method, traceparent, suspect, slices, \
             CASE WHEN bypass_cache = 1 THEN NULL ELSE cache_key END AS cache_key",
        );
        let rows = update.build().fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        let mut claims = rows.iter().map(read_claim).collect::<Result<Vec<_>, _>>()?;
        let places: HashMap<_, _> = ids.iter().zip(0..).collect();
        claims.sort_unstable_by_key(|claim| places.get(&claim.id).copied().unwrap_or(usize::MAX));
        Ok(claims)
    }
}

/// The ids of the next group among the first queued jobs of a tenant that has so many waiting.
fn choose(
    queued: &[SqliteRow],
    waiting: usize,
    request: &ClaimRequest<'_>,
) -> Result<Vec<Uuid>, StoreError> {
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

fn read_claim(row: &SqliteRow) -> Result<Claim, StoreError> {
    Ok(Claim {
        id: read_id(row)?,
        attempt: row.try_get("attempt")?,
        lease_number: read_count(row, "lease_number")?,
        method: row.try_get("method")?,
        traceparent: row.try_get("traceparent")?,
        cache_key: read_cache_key(row)?,
        suspect: row.try_get("suspect")?,
        slices: row.try_get("slices")?,
    })
}

/// Of no batch among these. Ids are hexadecimal digits and dashes and need no escaping.
fn none_of(batches: &HashSet<Uuid>) -> String {
    let ids: Vec<_> = batches.iter().map(|id| format!("'{id}'")).collect();
    format!("(batch_id IS NULL OR batch_id NOT IN ({}))", ids.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;
    use crate::jobs::store::sqlite::reap::{REAP, REAP_BYSTANDERS};

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
