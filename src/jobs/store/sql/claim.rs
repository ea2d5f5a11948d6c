//! Claims of queued jobs, leases, and slices.
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use railhead_macros::repeat_conflicts;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, DbConnection, DbRow, QueryBuilder, Row, SqlStore, query};
use super::rows::{
    count, fence, push_list, read_blob_ids, read_bytes, read_cache_key, read_count, read_flag,
    read_id, read_kind, read_move, read_optional_bytes, read_optional_id, read_result, read_small,
};
use crate::error::StoreError;
use crate::model::{Queue, State};
use crate::store::{
    Claim, ClaimKind, ClaimRequest, ClaimedCase, Claims, Lease, NewSlice, ReleaseReason, Renewal,
    Result, SliceRecord, StoredCase, StoredResult,
};

/// Selects the first jobs of the queue of tenant $1 and kind $5, at most $2; includes suspects if $6 is 1.
macro_rules! peek {
    ($begun:literal) => {
        concat!(
            "SELECT id, suspect, cost_us, rank FROM jobs \
             WHERE state = 'queued' AND tenant = $1 AND kind = $5 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND suspect <= $6 AND ",
            $begun,
            " AND (batch_id IS NULL OR batch_id NOT IN (SELECT id FROM batches WHERE complete = 0 AND tenant = $1)) \
             ORDER BY rank, id LIMIT $2",
            skip_locked!()
        )
    };
}

/// The first new jobs of a queue, by priority and age. Jobs whose deadline has passed and jobs of a batch that is not
/// complete are skipped.
pub(crate) const PEEK: &str = peek!("slices = 0");

/// As [`PEEK`], for jobs with stored slices.
pub(crate) const PEEK_BEGUN: &str = peek!("slices > 0");

/// The columns of a [`Claim`].
const CLAIMED: &str = "id, rank, attempt, lease_token, method, traceparent, suspect, slices, \
     CASE WHEN bypass_cache = 1 THEN NULL ELSE cache_key END AS cache_key";

/// Queues that have jobs.
pub(crate) const QUEUES: &str = "SELECT tenant, kind, CAST(SUM(number) AS bigint) AS waiting FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0 ORDER BY tenant, kind";

#[repeat_conflicts]
#[async_trait]
impl Claims for SqlStore {
    async fn queues(&self) -> Result<Vec<(Queue, u64)>> {
        if let Some(known) = self.known_queues() {
            return Ok(known);
        }
        let mut connection = self.readers.acquire().await?;
        let rows = sql!(fetch_all, &mut *connection, QUEUES)?;
        drop(connection);
        let read = |row: &DbRow| {
            let queue = Queue {
                tenant: row.try_get::<String, _>("tenant")?.into(),
                kind: read_kind(row)?,
            };
            Ok((queue, read_count(row, "waiting")?))
        };
        let queues = rows.iter().map(read).collect::<Result<Vec<_>>>()?;
        self.remember_queues(&queues);
        Ok(queues)
    }

    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>> {
        let mut claims = Vec::with_capacity(request.jobs);
        for row in &self.claim_next(request, new_token()?).await? {
            let rank: i64 = row.try_get("rank")?;
            claims.push((rank, read_claim(row)?));
        }
        claims.sort_unstable_by_key(|(rank, claim)| (*rank, claim.id));
        Ok(claims.into_iter().map(|(_, claim)| claim).collect())
    }

    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>> {
        if ids.is_empty() {
            return Ok(HashMap::new());
        }
        let mut query = QueryBuilder::new(
            "SELECT id, kind, cases.row, body, batch_id, cancel_requested, CASE WHEN bypass_cache = 0 AND jobs.cache_key IS NOT NULL THEN \
             (SELECT source.id FROM jobs AS source WHERE source.cache_key = jobs.cache_key AND source.state = 'succeeded' LIMIT 1) END AS source \
             FROM cases JOIN jobs ON jobs.id = cases.job_id \
             WHERE job_id IN ",
        );
        push_list(&mut query, ids);
        let mut connection = self.readers.acquire().await?;
        let rows = query.build().fetch_all(&mut *connection).await?;
        drop(connection);
        let mut templates: HashMap<String, (Bytes, Option<Bytes>)> = HashMap::new();
        let mut cases = HashMap::with_capacity(rows.len());
        for row in &rows {
            let (mut template, mut head) = (None, None);
            if read_flag(row, "row")? {
                let batch: String = row.try_get("batch_id")?;
                if !templates.contains_key(&batch)
                    && let Some(read) = self.template(&batch).await?
                {
                    templates.insert(batch.clone(), read);
                }
                let Some((of_batch, of_run)) = templates.get(&batch) else {
                    continue;
                };
                template = Some(of_batch.clone());
                head.clone_from(of_run);
            }
            let case = StoredCase {
                kind: read_kind(row)?,
                template,
                head,
                body: read_bytes(row, "body")?,
            };
            let claimed = ClaimedCase {
                case,
                cancel_requested: read_flag(row, "cancel_requested")?,
                source: read_optional_id(row, "source")?,
            };
            cases.insert(read_id(row)?, claimed);
        }
        Ok(cases)
    }

    async fn renew(&self, claims: &[(&Claim, f64)], lease: Lease) -> Result<Vec<Renewal>> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = QueryBuilder::new("WITH held (id, lease_token, now_at) AS (");
        query.push_values(claims, |mut row, (claim, progress)| {
            values!(row; claim.id.to_string(), fence(claim), *progress);
        });
        query.push(") UPDATE jobs SET lease_until = ");
        push_lease_until(&mut query, self, lease);
        query.push(concat!(
            ", progress = ",
            greatest!(),
            "(held.now_at, done), \
         version = CASE WHEN progress = ",
            greatest!(),
            "(held.now_at, done) THEN version ELSE version + 1 END"
        ));
        query.push(OF_HELD).push("jobs.id AS id, cancel_requested");
        let rows = query.build().fetch_all(&self.writer).await?;
        let mut held = HashMap::with_capacity(rows.len());
        for row in &rows {
            held.insert(read_id(row)?, read_flag(row, "cancel_requested")?);
        }
        let answers = claims.iter().map(|(claim, _)| match held.get(&claim.id) {
            Some(cancel_requested) => Renewal::Held {
                cancel_requested: *cancel_requested,
            },
            None => Renewal::Lost,
        });
        Ok(answers.collect())
    }

    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = QueryBuilder::new("WITH held (id, lease_token) AS (");
        query.push_values(claims, |mut row, claim| {
            values!(row; claim.id.to_string(), fence(claim));
        });
        query.push(
            ") UPDATE jobs SET state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
             started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
             attempt = attempt - 1, progress = done, lease_until = NULL, worker = NULL, \
             version = version + 1",
        );
        match why {
            ReleaseReason::NotBegun => {}
            ReleaseReason::SolveItself => drop(query.push(", bypass_cache = 1")),
            ReleaseReason::Long { slice_us } => {
                let slice_us = count(slice_us);
                query
                    .push(concat!(", slice_us = ", greatest!(), "(slice_us, "))
                    .push_bind(slice_us);
                query
                    .push(concat!("), cost_us = ", greatest!(), "(cost_us, "))
                    .push_bind(slice_us);
                query.push(")");
            }
        }
        query.push(", updated_at = ").push_bind(now);
        query.push(", ended_at = CASE WHEN cancel_requested = 1 THEN ");
        query.push_bind(now);
        query
            .push(" ELSE NULL END")
            .push(OF_HELD)
            .push("jobs.id AS id, state, slices");
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = query.build().fetch_all(&mut *transaction).await?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        self.requeued();
        rows.iter()
            .map(|row| read_move(row, State::Running))
            .collect()
    }

    async fn add_slice(&self, claim: &Claim, slice: &NewSlice) -> Result<bool> {
        let id = claim.id.to_string();
        let note = &slice.note;
        let spent_us = i64::try_from(note.spent.as_micros()).unwrap_or(i64::MAX);
        let mut transaction = engine::begin(&self.writer).await?;
        // Attempts are counted from the last stored slice: a job that makes progress does not crash its process.
        let added = sql!(execute, &mut *transaction,
            "UPDATE jobs SET attempt = 1, version = version + 1, slices = $1, done = $2, progress = $2, cost_us = $3 \
             WHERE id = $4 AND lease_token = $5 AND state = 'running'";
            i64::from(note.number) + 1, slice.done, count(slice.rest_us), &id, fence(claim)
        )?;
        if added.rows_affected() == 0 {
            return Ok(false);
        }
        let there = sql!(fetch_optional, &mut *transaction,
            "SELECT 1 FROM job_slices WHERE job_id = $1 AND number = $2 AND digest = $3 AND spent_us = $4";
            &id, i64::from(note.number), &note.digest, spent_us
        )?;
        if there.is_none() {
            let replaced = sql!(fetch_all, &mut *transaction,
                "DELETE FROM job_slices WHERE job_id = $1 AND number >= $2 RETURNING blob_id";
                &id, i64::from(note.number)
            )?;
            release_blobs(&mut transaction, read_blob_ids(&replaced)?).await?;
            let blobs = self
                .insert_blobs(&mut transaction, &[(claim, &slice.result)])
                .await?;
            sql!(execute, &mut *transaction,
                "INSERT INTO job_slices (job_id, number, motions, digest, spent_us, blob_id) \
                 VALUES ($1, $2, $3, $4, $5, $6)";
                &id, i64::from(note.number), i64::from(note.motions), &note.digest, spent_us,
                blobs.first()
            )?;
        }
        transaction.commit().await?;
        Ok(true)
    }

    async fn slices(&self, id: Uuid) -> Result<Vec<SliceRecord>> {
        let rows = sql!(fetch_all, &self.readers, NOTES; id.to_string())?;
        rows.iter()
            .map(|row| {
                Ok(SliceRecord {
                    number: read_small(row, "number")?,
                    motions: read_small(row, "motions")?,
                    digest: row.try_get("digest")?,
                    spent: Duration::from_micros(read_count(row, "spent_us")?),
                })
            })
            .collect()
    }

    async fn slice_results(&self, id: Uuid) -> Result<Vec<StoredResult>> {
        let rows = sql!(fetch_all, &self.readers, RESULTS; id.to_string())?;
        rows.iter().map(read_result).collect()
    }
}

/// A random token. No other claim has it, even after the database was restored from a backup.
fn new_token() -> Result<i64> {
    let random = getrandom::u64().map_err(|error| StoreError::Failed(Arc::new(error)))?;
    Ok(count(random >> 1))
}

/// Adds the expression for the expiry of a lease that begins now.
fn push_lease_until(query: &mut QueryBuilder, store: &SqlStore, lease: Lease) {
    query.push(engine::LEASE_NOW.0);
    query.push_bind(store.lease_now(lease.now));
    query.push(engine::LEASE_NOW.1).push(" + ");
    query.push_bind(lease.ms);
}

fn read_claim(row: &DbRow) -> Result<Claim> {
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

/// Selects the first jobs of a queue with the statement `peek`.
pub(crate) async fn first_queued(
    connection: &mut DbConnection,
    peek: &'static str,
    request: &ClaimRequest<'_>,
    most: usize,
) -> Result<Vec<DbRow>> {
    let rows = sql!(fetch_all, connection,
        peek;
        &*request.queue.tenant, count(most), request.late_before,
        request.each_slice_us.map_or(i64::MAX, count), request.queue.kind.name(),
        i64::from(request.suspects)
    )?;
    Ok(rows)
}

/// The ids of the next group: the first of the queued jobs, and the jobs after it that fit the bounds of the request.
fn choose(queued: &[DbRow], request: &ClaimRequest<'_>) -> Result<Vec<Uuid>> {
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

impl SqlStore {
    /// Claims the next jobs of a queue; the rows have the columns of `CLAIMED`.
    async fn claim_next(&self, request: &ClaimRequest<'_>, token: i64) -> Result<Vec<DbRow>> {
        let mut transaction = engine::begin_claim(&self.writer).await?;
        let queued = match request.kind {
            ClaimKind::New => self.first_new(&mut transaction, request).await?,
            ClaimKind::Begun => first_queued(&mut transaction, PEEK_BEGUN, request, 1).await?,
        };
        if queued.is_empty() {
            return Ok(Vec::new());
        }
        let ids = choose(&queued, request)?;
        let mut update = QueryBuilder::new(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_token = ",
        );
        update.push_bind(token).push(", lease_until = ");
        push_lease_until(&mut update, self, request.lease);
        update.push(", worker = ").push_bind(request.worker);
        update.push(", started_at = ").push_bind(request.now);
        update.push(", updated_at = ").push_bind(request.now);
        update.push(", group_size = ");
        update.push_bind(count(ids.len()));
        update.push(concat!(
            ", progress = done, version = version + 1 WHERE ",
            bare!("state"),
            " = 'queued' AND id IN "
        ));
        push_list(&mut update, ids);
        update.push(" RETURNING ").push(CLAIMED);
        let rows = update.build().fetch_all(&mut *transaction).await?;
        transaction.commit().await?;
        Ok(rows)
    }

    /// Reads the template of a batch, and the head of a run.
    async fn template(&self, batch: &str) -> Result<Option<(Bytes, Option<Bytes>)>> {
        let row = sql!(fetch_optional, &self.readers,
            "SELECT body, head FROM batches JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
             WHERE batches.id = $1";
            batch
        )?;
        // The template is removed with the last job of its batch.
        let Some(row) = row else { return Ok(None) };
        Ok(Some((
            read_bytes(&row, "body")?,
            read_optional_bytes(&row, "head")?,
        )))
    }
}

/// The end of an update that is restricted to jobs whose leases are held.
const OF_HELD: &str = concat!(
    " FROM held WHERE jobs.id = held.id AND jobs.lease_token = held.lease_token AND ",
    unordered!("jobs.state"),
    " = 'running' RETURNING "
);

pub(crate) const NOTES: &str =
    "SELECT number, motions, digest, spent_us FROM job_slices WHERE job_id = $1 ORDER BY number";

pub(crate) const RESULTS: &str = "SELECT key AS blob_key, bytes AS blob_bytes, solution, fields FROM job_slices JOIN blobs ON blobs.id = blob_id \
     WHERE job_id = $1 ORDER BY number";
