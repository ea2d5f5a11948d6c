//! Claims and ends of small jobs in groups: one transaction, and so one write to the disk, for all of them.

use std::collections::{HashMap, HashSet};
use std::sync::PoisonError;

use bytes::Bytes;
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::State;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::blobs::{insert_blobs, release_blobs};
use crate::jobs::store::sqlite::claims::{EndRow, fence};
use crate::jobs::store::sqlite::rows::{read_count, read_id, read_reuse_key, read_state};
use crate::jobs::store::{Claim, Ending, StoredCase};

/// The tenant with queued jobs that comes next in the alphabet.
pub(super) const NEXT_TENANT: &str =
    "SELECT tenant FROM jobs WHERE state = 'queued' AND tenant > $1 ORDER BY tenant LIMIT 1";
/// The queued jobs of a tenant that come first: by priority, the oldest of each first. Jobs whose deadline has passed are
/// left to whoever ends them.
pub(super) const PEEK: &str = "SELECT id, alone, cost_us FROM jobs \
     WHERE state = 'queued' AND tenant = $1 AND (deadline IS NULL OR deadline > $3) ORDER BY rank, id LIMIT $2";

/// How large a group may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GroupBounds {
    /// Most jobs.
    pub jobs: usize,
    /// Largest sum of the expected solve times in µs.
    pub cost_us: u64,
    /// Workers among which the queue is shared.
    pub workers: usize,
}

impl SqliteStore {
    /// Claims the first queued job of the tenant whose turn it is, for `lease_ms` milliseconds.
    ///
    /// # Errors
    /// The database failed.
    pub async fn claim(
        &self,
        worker: &str,
        now: i64,
        lease_ms: i64,
    ) -> Result<Option<Claim>, JobsError> {
        let one = GroupBounds {
            jobs: 1,
            cost_us: 0,
            workers: 1,
        };
        Ok(self
            .claim_group(worker, now, lease_ms, one, &HashSet::new())
            .await?
            .pop())
    }

    /// Claims the first queued job of the tenant whose turn it is, together with those behind it that are as small, in
    /// their order: by priority, then by age; those of the batches in `skip` are left alone. A job whose group died comes alone. Tenants take turns, so that a long queue of one holds up no
    /// other.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn claim_group(
        &self,
        worker: &str,
        now: i64,
        lease_ms: i64,
        bounds: GroupBounds,
        skip: &HashSet<Uuid>,
    ) -> Result<Vec<Claim>, JobsError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let look = bounds.jobs.saturating_mul(bounds.workers.max(1));
        let served = self.served().clone();
        let mut tenant = None;
        // After the last tenant in the alphabet the first one has its turn again.
        for after in [served.as_str(), ""] {
            if tenant.is_none() {
                tenant = sqlx::query_scalar::<_, String>(NEXT_TENANT)
                    .bind(after)
                    .fetch_optional(&mut *transaction)
                    .await?;
            }
        }
        let Some(tenant) = tenant else {
            return Ok(Vec::new());
        };
        let peek = match skip.is_empty() {
            true => PEEK.to_owned(),
            false => PEEK.replace(" ORDER BY", &format!(" AND {} ORDER BY", none_of(skip))),
        };
        let queued = sqlx::query(AssertSqlSafe(peek))
            .bind(&tenant)
            .bind(i64::try_from(look).unwrap_or(i64::MAX))
            .bind(now)
            .fetch_all(&mut *transaction)
            .await?;
        let ids = choose(&queued, bounds)?;
        if ids.is_empty() {
            return Ok(Vec::new());
        }
        let mut update = QueryBuilder::<Sqlite>::new(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_number = lease_number + 1, lease_until = ",
        );
        update.push_bind(now.saturating_add(lease_ms));
        update.push(", worker = ").push_bind(worker);
        update.push(", started_at = ").push_bind(now);
        update.push(", group_size = ");
        update.push_bind(i64::try_from(ids.len()).unwrap_or(i64::MAX));
        update.push(", progress = 0, version = version + 1 WHERE id IN (");
        push_list(&mut update, &ids);
        update.push(
            ") RETURNING id, attempt, lease_number, method, traceparent, CASE WHEN fresh THEN NULL ELSE reuse_key END AS reuse_key",
        );
        let rows = update.build().fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        *self.served() = tenant;
        let mut claims = rows
            .iter()
            .map(|row| {
                Ok(Claim {
                    id: read_id(row)?,
                    attempt: row.try_get("attempt")?,
                    lease_number: read_count(row, "lease_number")?,
                    method: row.try_get("method")?,
                    traceparent: row.try_get("traceparent")?,
                    reuse_key: read_reuse_key(row)?,
                })
            })
            .collect::<Result<Vec<_>, JobsError>>()?;
        let places: HashMap<_, _> = ids.iter().zip(0..).collect();
        claims.sort_unstable_by_key(|claim| places.get(&claim.id).copied().unwrap_or(usize::MAX));
        Ok(claims)
    }

    fn served(&self) -> std::sync::MutexGuard<'_, String> {
        self.served.lock().unwrap_or_else(PoisonError::into_inner)
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

    /// Extends the leases of a group. Returns the jobs still held, with whether their cancellation was asked for.
    ///
    /// # Errors
    /// The database failed; the leases stand as they were.
    pub async fn renew_group(
        &self,
        claims: &[Claim],
        now: i64,
        lease_ms: i64,
    ) -> Result<HashMap<Uuid, bool>, JobsError> {
        let mut query = with_held(claims);
        query.push(" UPDATE jobs SET lease_until = ");
        query.push_bind(now.saturating_add(lease_ms));
        query.push(OF_HELD).push("id, cancel_requested");
        let rows = query.build().fetch_all(&self.writer).await?;
        rows.iter()
            .map(|row| Ok((read_id(row)?, row.try_get("cancel_requested")?)))
            .collect()
    }

    /// Hands running jobs back to the queue without counting their attempts; those whose cancellation was asked for end as
    /// cancelled instead. Returns those that were still held, with their new states.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn release_group(
        &self,
        claims: &[Claim],
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        self.release_many(claims, now, "fresh").await
    }

    /// As [`SqliteStore::release_group`]; these jobs will not get the result of another any more.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn release_to_be_solved(
        &self,
        claims: &[Claim],
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        self.release_many(claims, now, "1").await
    }

    async fn release_many(
        &self,
        claims: &[Claim],
        now: i64,
        fresh: &'static str,
    ) -> Result<Vec<(Uuid, State)>, JobsError> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = with_held(claims);
        query.push(
            " UPDATE jobs SET state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
             started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
             attempt = attempt - 1, progress = 0, lease_until = NULL, worker = NULL, version = version + 1, \
             fresh = ",
        );
        query.push(fresh);
        query.push(", ended_at = CASE WHEN cancel_requested = 1 THEN ");
        query.push_bind(now);
        query.push(" ELSE NULL END").push(OF_HELD).push("id, state");
        let rows = query.build().fetch_all(&self.writer).await?;
        rows.iter()
            .map(|row| Ok((read_id(row)?, read_state(row)?)))
            .collect()
    }

    /// Ends jobs, all in one transaction. Returns those that ended; the others' leases were lost and nothing of them
    /// changed.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn finish_group(
        &self,
        ends: &[(Claim, Ending)],
        now: i64,
    ) -> Result<HashSet<Uuid>, JobsError> {
        if ends.is_empty() {
            return Ok(HashSet::new());
        }
        let rows = ends
            .iter()
            .map(|(claim, ending)| Ok((claim, EndRow::of(ending)?)))
            .collect::<Result<Vec<_>, JobsError>>()?;
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let results: Vec<_> = rows.iter().filter_map(|(_, end)| end.result).collect();
        let mut blobs = insert_blobs(&mut transaction, &results).await?.into_iter();
        let mut update = QueryBuilder::<Sqlite>::new(
            "WITH done (id, lease_number, state, remarks, failure, blob, patches) AS (",
        );
        let mut inserted = Vec::with_capacity(results.len());
        update.push_values(&rows, |mut row, (claim, end)| {
            let blob = end.result.and_then(|_| blobs.next());
            inserted.extend(blob);
            row.push_bind(claim.id.to_string())
                .push_bind(fence(claim))
                .push_bind(end.state.name())
                .push_bind(&end.remarks)
                .push_bind(&end.failure)
                .push_bind(blob)
                .push_bind(end.field_patches);
        });
        update.push(") UPDATE jobs SET state = done.state, ended_at = ");
        update.push_bind(now);
        update.push(
            ", remarks = done.remarks, failure = done.failure, blob_id = done.blob, \
             field_patches = done.patches, \
             progress = CASE WHEN done.state = 'succeeded' THEN 1.0 ELSE progress END, \
             lease_until = NULL, worker = NULL, version = version + 1 \
             FROM done WHERE jobs.id = done.id AND jobs.lease_number = done.lease_number \
             AND jobs.state = 'running' RETURNING id",
        );
        let ended = update.build().fetch_all(&mut *transaction).await?;
        let ended = ended
            .iter()
            .map(read_id)
            .collect::<Result<HashSet<_>, _>>()?;
        if ended.len() < rows.len() {
            // The results of those whose lease was lost have no owner.
            release_blobs(&mut transaction, inserted).await?;
        }
        transaction.commit().await?;
        Ok(ended)
    }
}

/// The ids of the next group among the first queued jobs.
fn choose(queued: &[SqliteRow], bounds: GroupBounds) -> Result<Vec<Uuid>, JobsError> {
    let share = queued
        .len()
        .div_ceil(bounds.workers.max(1))
        .min(bounds.jobs);
    let mut ids = Vec::with_capacity(share);
    let mut cost_us = 0;
    for row in &queued[..share] {
        let alone: bool = row.try_get("alone")?;
        cost_us += read_count(row, "cost_us")?;
        if !ids.is_empty() && (alone || cost_us > bounds.cost_us) {
            break;
        }
        ids.push(read_id(row)?);
        if alone {
            break;
        }
    }
    Ok(ids)
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

pub(super) fn push_list(query: &mut QueryBuilder<Sqlite>, ids: &[Uuid]) {
    let mut list = query.separated(", ");
    for id in ids {
        list.push_bind(id.to_string());
    }
}
