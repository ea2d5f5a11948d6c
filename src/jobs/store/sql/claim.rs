//! Claims of queued jobs, leases, and slices.
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::Duration;

use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, DbConnection, DbRow, Row, SqlStore, query};
use super::rows::{
    count, fence, read_blob_ids, read_bytes, read_cache_key, read_count, read_flag, read_id,
    read_kind, read_move, read_optional_bytes, read_optional_id, read_result, read_small, to_json,
};
use crate::error::StoreError;
use crate::model::{Queue, State};
use crate::store::{
    Claim, ClaimKind, ClaimRequest, ClaimedCase, Lease, NewSlice, ReleaseReason, Result,
    SliceRecord, StoredCase, StoredResult,
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
pub(crate) const CLAIM: &str = concat!(
    "UPDATE jobs SET state = 'running', attempt = attempt + 1, lease_token = $1, lease_until = ",
    lease_now!("$2"),
    " + $3, worker = $4, started_at = $5, updated_at = $5, group_size = $6, progress = done, version = version + 1 WHERE ",
    bare!("state"),
    " = 'queued' AND id",
    in_list!("$7"),
    " RETURNING id, rank, attempt, lease_token, method, traceparent, suspect, slices, \
     CASE WHEN bypass_cache = 1 THEN NULL ELSE cache_key END AS cache_key"
);

pub(crate) const QUEUES: &str = "SELECT tenant, kind, CAST(SUM(number) AS bigint) AS waiting FROM job_counts WHERE state = 'queued' GROUP BY tenant, kind HAVING SUM(number) > 0 ORDER BY tenant, kind";

/// Claims of queued jobs, and calls of workers that hold a lease.
#[store_trait]
impl Claims for SqlStore {
    /// Queues that have jobs, with their number.
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

    /// Claims the first job of a queue, by priority and age, with the jobs after it that fit the bounds of a group. A
    /// suspect is claimed alone. Jobs of a batch that is not acknowledged are skipped.
    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>> {
        let mut transaction = engine::begin_claim(&self.writer).await?;
        let queued = match request.kind {
            ClaimKind::New => self.first_new(&mut transaction, request).await?,
            ClaimKind::Begun => first_queued(&mut transaction, PEEK_BEGUN, request, 1).await?,
        };
        if queued.is_empty() {
            return Ok(Vec::new());
        }
        let ids = choose(&queued, request)?;
        let rows = sql!(fetch_all, &mut *transaction,
            CLAIM;
            new_token()?, self.lease_now(request.lease.now), request.lease.ms, request.worker, request.now,
            count(ids.len()), to_json(&ids)?
        )?;
        transaction.commit().await?;
        let mut claims = Vec::with_capacity(rows.len());
        for row in &rows {
            let rank: i64 = row.try_get("rank")?;
            claims.push((rank, read_claim(row)?));
        }
        claims.sort_unstable_by_key(|(rank, claim)| (*rank, claim.id));
        Ok(claims.into_iter().map(|(_, claim)| claim).collect())
    }

    /// Reads the cases of claimed jobs, with changes since the claim.
    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>> {
        if ids.is_empty() {
            return Ok(HashMap::new());
        }
        let mut connection = self.readers.acquire().await?;
        let rows = sql!(fetch_all, &mut *connection,
            concat!(
                "SELECT id, kind, cases.row, body, batch_id, cancel_requested, CASE WHEN bypass_cache = 0 AND jobs.cache_key IS NOT NULL THEN \
                 (SELECT source.id FROM jobs AS source WHERE source.cache_key = jobs.cache_key AND source.state = 'succeeded' LIMIT 1) END AS source \
                 FROM cases JOIN jobs ON jobs.id = cases.job_id WHERE job_id",
                in_list!("$1")
            );
            to_json(ids)?
        )?;
        let mut batches = HashSet::new();
        for row in &rows {
            if read_flag(row, "row")? {
                batches.insert(row.try_get::<String, _>("batch_id")?);
            }
        }
        let templates = match batches.is_empty() {
            true => Vec::new(),
            false => sql!(fetch_all, &mut *connection, TEMPLATES; to_json(&batches)?)?,
        };
        drop(connection);
        let read = |row: &DbRow| {
            let body = read_bytes(row, "body")?;
            Ok((read_id(row)?, (body, read_optional_bytes(row, "head")?)))
        };
        let templates = templates.iter().map(read);
        let templates = templates.collect::<Result<HashMap<Uuid, _>>>()?;
        let mut cases = HashMap::with_capacity(rows.len());
        for row in &rows {
            let (mut template, mut head) = (None, None);
            if read_flag(row, "row")? {
                let batch = read_optional_id(row, "batch_id")?;
                // The template is removed with the last job of its batch.
                let Some((of_batch, of_run)) = batch.and_then(|id| templates.get(&id)) else {
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

    /// Extends leases and stores progress; returns the jobs whose leases are held.
    async fn renew(&self, claims: &[(&Claim, f64)], lease: Lease) -> Result<HashSet<Uuid>> {
        if claims.is_empty() {
            return Ok(HashSet::new());
        }
        let held = claims
            .iter()
            .map(|(claim, progress)| (claim.id, fence(claim), progress));
        let rows = sql!(fetch_all, &self.writer,
            RENEW;
            to_json(&held.collect::<Vec<_>>())?, self.lease_now(lease.now), lease.ms
        )?;
        rows.iter().map(read_id).collect()
    }

    /// Returns claimed jobs to the queue without counting the attempt; jobs that were cancelled end. Returns the jobs that
    /// were still held, with their new states.
    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let held: Vec<_> = claims
            .iter()
            .map(|claim| (claim.id, fence(claim)))
            .collect();
        let (slice_us, bypass_cache): (i64, i64) = match why {
            ReleaseReason::NotBegun => (0, 0),
            ReleaseReason::SolveItself => (0, 1),
            ReleaseReason::Long { slice_us } => (count(slice_us), 0),
        };
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = sql!(fetch_all, &mut *transaction,
            RELEASE;
            to_json(&held)?, now, slice_us, bypass_cache
        )?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        self.requeued();
        rows.iter()
            .map(|row| read_move(row, State::Running))
            .collect()
    }

    /// Stores a solved slice and removes stored slices from its number on; `false` if the lease was lost. The count of
    /// attempts starts again. A repeated call changes nothing.
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

    /// The stored slices of a job in their order. They are removed when the job ends.
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

    /// The results of the stored slices of a job, in their order.
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

/// An update of the jobs whose leases are held: the claims are `$1`, as a JSON array of ids and tokens, and of the progress
/// for [`RENEW`].
macro_rules! update_held {
    ($($changes:expr),+) => {
        concat!(
            "WITH held AS (SELECT value ->> 0 AS id, CAST(value ->> 1 AS bigint) AS lease_token, \
             CAST(value ->> 2 AS double precision) AS now_at FROM ",
            json_rows!("$1"),
            ") UPDATE jobs SET ",
            $($changes,)+
            " FROM held WHERE jobs.id = held.id AND jobs.lease_token = held.lease_token \
             AND jobs.state || '' = 'running' RETURNING jobs.id AS id, state, slices"
        )
    };
}

pub(crate) const RENEW: &str = update_held!(
    "lease_until = ",
    lease_now!("$2"),
    " + $3, progress = ",
    greatest!(),
    "(held.now_at, done), \
     version = CASE WHEN progress = ",
    greatest!(),
    "(held.now_at, done) THEN version ELSE version + 1 END"
);

pub(crate) const RELEASE: &str = update_held!(
    "state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
     started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
     ended_at = CASE WHEN cancel_requested = 1 THEN $2 ELSE NULL END, updated_at = $2, \
     attempt = attempt - 1, progress = done, lease_until = NULL, worker = NULL, version = version + 1, \
     slice_us = ",
    greatest!(),
    "(slice_us, $3), cost_us = ",
    greatest!(),
    "(cost_us, $3), \
     bypass_cache = ",
    greatest!(),
    "(bypass_cache, $4)"
);

const TEMPLATES: &str = concat!(
    "SELECT batches.id, body, head FROM batches \
     JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template WHERE batches.id",
    in_list!("$1")
);

pub(crate) const NOTES: &str =
    "SELECT number, motions, digest, spent_us FROM job_slices WHERE job_id = $1 ORDER BY number";

pub(crate) const RESULTS: &str = "SELECT key AS blob_key, bytes AS blob_bytes, solution, fields FROM job_slices JOIN blobs ON blobs.id = blob_id \
     WHERE job_id = $1 ORDER BY number";
