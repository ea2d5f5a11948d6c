//! Batches in the job table: filled in portions, acknowledged once complete.
//!
//! Jobs of a batch that is not complete are excluded from claims. A batch that a crashed process left incomplete was never
//! acknowledged and is removed with its jobs.
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use bytes::Bytes;
use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, DbConnection, DbRow, Row, SqlStore, built, query, query_scalar};
use super::finish::find_sources;
use super::rows::{
    and_labels, and_name, count, job_columns, read_blob_ids, read_bytes, read_count, read_flag,
    read_id, read_job, read_json, read_kind, read_optional_bytes, read_small, read_state, to_json,
};
use super::submit::{Places, insert_jobs};
use crate::error::StoreError;
use crate::model::{Batch, BatchItem, Kind, RunRecord, State};
use crate::store::{
    BatchBegun, FilledHere, Filter, NewBatch, NewJob, Page, QueueBounds, Result, Total,
};

macro_rules! batch_columns {
    () => {
        "id, tenant, kind, created_at, count, rejected, name, labels, ended_at"
    };
}

const CANCEL: &str = concat!(
    "WITH open AS MATERIALIZED (SELECT id FROM jobs \
     WHERE batch_id = (SELECT id FROM batches WHERE id = $2 AND tenant = $4) \
     AND ended_at IS NULL AND cancel_requested = 0 ORDER BY id LIMIT $3",
    for_update!(),
    ") \
     UPDATE jobs SET state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
     ended_at = CASE WHEN state = 'queued' THEN $1 ELSE NULL END, \
     cancel_requested = 1, version = version + 1, updated_at = $1 \
     WHERE id IN (SELECT id FROM open) RETURNING id, state, slices"
);

/// Batches and runs: filled in portions, acknowledged once complete, read and removed as a whole.
#[store_trait]
impl Batches for SqlStore {
    /// Begins to fill a batch, whose places are then reserved, or finds the batch of its idempotency key. The key of an
    /// unfinished batch that no process fills is free.
    async fn begin_batch(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
        bounds: QueueBounds,
    ) -> Result<BatchBegun> {
        let mut transaction = engine::begin(&self.writer).await?;
        engine::lock_admission(&mut transaction).await?;
        if let Some(begun) = by_key(&mut transaction, new, filled_here).await? {
            return Ok(begun);
        }
        let mut places = Places::of(&mut transaction, [&*new.tenant], bounds).await?;
        if let Err(refusal) = places.take(&new.tenant, new.count) {
            return Ok(BatchBegun::Refused(refusal));
        }
        let template = new.template.as_ref();
        let template = template.map(|body| (blake3::hash(body).as_bytes().to_vec(), body));
        let mut bytes = new.bytes;
        if let Some((digest, body)) = &template {
            let added = sql!(execute, &mut *transaction,
                "INSERT INTO templates (tenant, digest, body) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING";
                &*new.tenant, digest, body.as_ref()
            )?;
            bytes += added.rows_affected() * body.len() as u64;
        }
        if let Err(refusal) = places.store(&new.tenant, bytes) {
            return Ok(BatchBegun::Refused(refusal));
        }
        sql!(execute, &mut *transaction,
            "INSERT INTO batches (id, tenant, created_at, count, rejected, reserved, name, labels, template, head, kind) \
             VALUES ($1, $2, $3, $4, $5, $4, $6, $7, $8, $9, $10)";
            new.id.to_string(), &*new.tenant, new.created_at, i64::from(new.count),
            i64::from(new.rejected), &new.name, to_json(&new.labels)?,
            template.as_ref().map(|(digest, _)| digest), new.head.as_deref(), new.kind.name()
        )?;
        if let Some((key, digest)) = &new.idempotency {
            // An existing key belongs to a batch that failed.
            sql!(execute, &mut *transaction,
                "INSERT INTO batch_keys (of_tenant, key, digest, batch_id, kind) VALUES ($1, $2, $3, $4, $5) \
                 ON CONFLICT (of_tenant, kind, key) DO UPDATE SET digest = $3, batch_id = $4";
                &*new.tenant, key, digest.as_slice(), new.id.to_string(), new.kind.name()
            )?;
        }
        transaction.commit().await?;
        Ok(BatchBegun::Created)
    }

    /// Inserts jobs of a batch, with their indices in it, on its reserved places. Returns the jobs that ended at once with
    /// a cached result.
    async fn fill_batch(&self, batch: Uuid, jobs: &[(u32, NewJob)]) -> Result<Vec<Uuid>> {
        let jobs: Vec<_> = jobs
            .iter()
            .map(|(index, job)| (Some(*index), job))
            .collect();
        let mut transaction = engine::begin(&self.writer).await?;
        let filled = sql!(execute, &mut *transaction,
            concat!(
                "UPDATE batches SET reserved = ",
                greatest!(),
                "(reserved - $1, 0) WHERE id = $2 AND dropped = 0"
            );
            count(jobs.len()), batch.to_string()
        )?;
        require_batch(batch, filled.rows_affected())?;
        let sources = find_sources(&mut transaction, jobs.iter().map(|(_, job)| *job)).await?;
        let ended = insert_jobs(&mut transaction, Some(batch), &jobs, &sources).await?;
        transaction.commit().await?;
        Ok(ended)
    }

    /// Acknowledges a batch: from now on it is visible and durable.
    async fn complete_batch(&self, id: Uuid) -> Result<()> {
        let complete = sql!(execute, &self.writer,
            "UPDATE batches SET complete = 1, reserved = 0 WHERE id = $1 AND dropped = 0";
            id.to_string()
        )?;
        require_batch(id, complete.rows_affected())
    }

    /// Removes up to `limit` jobs of a batch that was never acknowledged, and the batch after the last of them; `true` once
    /// nothing is left. The first call frees its places and its key.
    async fn drop_batch(&self, id: Uuid, limit: u32) -> Result<bool> {
        let mut transaction = engine::begin(&self.writer).await?;
        for statement in [
            "UPDATE batches SET reserved = 0, dropped = 1 WHERE id = $1 AND complete = 0 AND dropped = 0",
            "DELETE FROM batch_keys WHERE batch_id = $1 \
             AND EXISTS (SELECT 1 FROM batches WHERE id = $1 AND complete = 0)",
        ] {
            sql!(execute, &mut *transaction, statement; id.to_string())?;
        }
        let gone = sql!(fetch_all, &mut *transaction,
            "DELETE FROM jobs WHERE id IN (SELECT id FROM jobs WHERE batch_id = $1 ORDER BY id LIMIT $2) \
             AND EXISTS (SELECT 1 FROM batches WHERE id = $1 AND complete = 0) RETURNING blob_id";
            id.to_string(), i64::from(limit)
        )?;
        release_blobs(&mut transaction, read_blob_ids(&gone)?).await?;
        let last = gone.len() < limit as usize;
        if last {
            sql!(execute, &mut *transaction,
                "DELETE FROM batches WHERE id = $1 AND complete = 0";
                id.to_string()
            )?;
        }
        transaction.commit().await?;
        Ok(last)
    }

    /// The batches that are not acknowledged and that no process fills.
    async fn unfinished_batches(&self) -> Result<Vec<Uuid>> {
        let rows = sql!(
            fetch_all,
            &self.readers,
            concat!(
                "SELECT id FROM batches WHERE complete = 0 AND ",
                being_filled!(),
                " = 0"
            )
        )?;
        rows.iter().map(read_id).collect()
    }

    /// Cancels up to `limit` jobs of a batch; returns the jobs that changed.
    async fn cancel_batch(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>> {
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = sql!(fetch_all, &mut *transaction,
            CANCEL;
            now, id.to_string(), i64::from(limit), tenant
        )?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        rows.iter()
            .map(|row| Ok((read_id(row)?, read_state(row)?)))
            .collect()
    }

    /// Removes up to `limit` ended jobs of a batch, and the batch with its last job; `true` once no ended job is left.
    async fn delete_batch(&self, tenant: &str, id: Uuid, limit: u32) -> Result<bool> {
        let mut transaction = engine::begin(&self.writer).await?;
        let gone = sql!(fetch_all, &mut *transaction,
            "DELETE FROM jobs WHERE id IN (SELECT id FROM jobs \
             WHERE batch_id = (SELECT id FROM batches WHERE id = $1 AND tenant = $3) AND \
             state IN ('succeeded', 'failed', 'cancelled') ORDER BY id LIMIT $2) RETURNING blob_id";
            id.to_string(), i64::from(limit), tenant
        )?;
        release_blobs(&mut transaction, read_blob_ids(&gone)?).await?;
        let last = gone.len() < limit as usize;
        if last {
            sql!(execute, &mut *transaction,
                "DELETE FROM batches WHERE id = $1 AND tenant = $2 AND complete = 1 \
                 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = $1)";
                id.to_string(), tenant
            )?;
        }
        transaction.commit().await?;
        Ok(last)
    }

    /// Up to `limit` jobs of a batch after the job `after`, in the order of submission, with their small solutions. The
    /// list ends once the solutions reach `bytes`.
    async fn batch_items(
        &self,
        tenant: &str,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        bytes: usize,
    ) -> Result<Vec<BatchItem>> {
        let rows = query(concat!(
            "SELECT ",
            job_columns!(),
            ", batch_index, outputs, blob_key, solution FROM jobs \
             LEFT JOIN (SELECT id AS blob, key AS blob_key, solution FROM blobs) AS stored ON blob = blob_id \
             WHERE batch_id = (SELECT id FROM batches WHERE id = $1 AND tenant = $4) AND id > $2 ORDER BY id LIMIT $3"
        ))
        .bind(id.to_string())
        .bind(after.map_or_else(String::new, |id| id.to_string()))
        .bind(i64::from(limit))
        .bind(tenant);
        let mut items = Vec::new();
        let mut read = 0;
        engine::for_each(rows, &self.readers, |row| {
            let solution = read_optional_bytes(row, "solution")?;
            read += solution.as_ref().map_or(0, Bytes::len);
            items.push(BatchItem {
                index: read_small(row, "batch_index")?,
                job: read_job(row)?,
                outputs: row.try_get("outputs")?,
                solution,
                key: row.try_get("blob_key")?,
            });
            Ok(read < bytes)
        })
        .await?;
        Ok(items)
    }

    /// The keys of the labels of the jobs of a batch, sorted, at most `limit`.
    async fn batch_label_keys(&self, tenant: &str, id: Uuid, limit: u32) -> Result<Vec<String>> {
        let keys = sql!(scalar fetch_all, &self.readers,
            concat!(
                "SELECT DISTINCT label.key FROM jobs, ",
                pairs_of_labels!(),
                " AS label WHERE batch_id = (SELECT id FROM batches WHERE id = $1 AND tenant = $2) ORDER BY label.key LIMIT $3"
            );
            id.to_string(), tenant, i64::from(limit)
        )?;
        Ok(keys)
    }

    /// One page of the acknowledged batches of a tenant with their counts, newest first, starting with the first one older
    /// than `after`.
    async fn batches(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Batch>> {
        let page = page_text(batch_columns!(), filter);
        let most = i64::from(limit) + 1;
        let mut rows = self.page(page, tenant, filter, after, most).await?;
        let more = rows.len() > limit as usize;
        rows.truncate(limit as usize);
        let batches = self.with_counts(&rows).await?;
        let last = batches.last().filter(|_| more);
        let total = self.count_batches(tenant, filter).await?;
        Ok(Page {
            next_cursor: last.map(|batch| filter.cursor_after(batch.id)),
            total,
            entries: batches,
        })
    }

    /// An acknowledged batch or run with its counts.
    async fn batch(&self, tenant: &str, kind: Kind, id: Uuid) -> Result<Option<Batch>> {
        let rows = sql!(fetch_all, &self.readers,
            concat!("SELECT ", batch_columns!(), " FROM batches WHERE complete = 1 AND id = $1 AND tenant = $2 AND kind = $3");
            id.to_string(), tenant, kind.name()
        )?;
        Ok(self.with_counts(&rows).await?.pop())
    }

    /// The stored record of an acknowledged run, with the progress of its chunks.
    async fn run(&self, tenant: &str, id: Uuid) -> Result<Option<RunRecord>> {
        let row = sql!(fetch_optional, &self.readers, GET_RUN; id.to_string(), tenant)?;
        let Some(row) = row else { return Ok(None) };
        Ok(Some(RunRecord {
            template: read_bytes(&row, "body")?,
            head: read_optional_bytes(&row, "head")?,
            without_answer: read_count(&row, "without_answer")?,
            last_lost: read_count(&row, "last_lost")? > 0,
            running: row.try_get("running")?,
        }))
    }
}

/// Fails if no row was found, because the batch was abandoned.
fn require_batch(id: Uuid, found: u64) -> Result<()> {
    match found {
        0 => Err(StoreError::Failed(Arc::new(std::io::Error::other(
            format!("batch {id} was given up"),
        )))),
        _ => Ok(()),
    }
}

async fn by_key(
    connection: &mut DbConnection,
    new: &NewBatch,
    filled_here: FilledHere<'_>,
) -> Result<Option<BatchBegun>> {
    let Some((key, digest)) = &new.idempotency else {
        return Ok(None);
    };
    let row = sql!(fetch_optional, connection,
        concat!(
            "SELECT digest, id, complete, ",
            being_filled!(),
            " AS filled FROM batch_keys JOIN batches ON batches.id = batch_keys.batch_id \
             WHERE of_tenant = $1 AND key = $2 AND batch_keys.kind = $3"
        );
        &*new.tenant, key, new.kind.name()
    )?;
    let Some(row) = row else { return Ok(None) };
    let stored: Vec<u8> = row.try_get("digest")?;
    let (id, complete) = (read_id(&row)?, read_flag(&row, "complete")?);
    let filled = read_flag(&row, "filled")? || filled_here(id);
    Ok(match (stored == digest, complete) {
        // The batch is no longer filled and was never acknowledged.
        (_, false) if !filled => None,
        (false, _) => Some(BatchBegun::Conflict),
        (true, true) => Some(BatchBegun::Existing(id)),
        (true, false) => Some(BatchBegun::Unfinished),
    })
}

/// Maximum number of batches that are counted for one page.
const EXAMINED_MAX: i64 = 10_000;

/// The columns of a [`Batch`].
impl SqlStore {
    /// Runs a statement with [`page_text`] and its parameters.
    async fn page(
        &self,
        text: String,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        most: i64,
    ) -> Result<Vec<DbRow>> {
        Ok(sql!(built fetch_all, &self.readers,
            text;
            tenant, filter.kind.name(), filter.first_id(), filter.last_id(after), filter.lower_name(),
            to_json(&filter.labels)?, most
        )?)
    }

    async fn count_batches(&self, tenant: &str, filter: &Filter) -> Result<Total> {
        let counted = page_text("id", filter);
        let text = format!("SELECT COUNT(*) AS number FROM ({counted}) AS counted");
        let rows = self.page(text, tenant, filter, None, EXAMINED_MAX).await?;
        let number = read_count(&rows[0], "number")?;
        Ok(match number < EXAMINED_MAX.unsigned_abs() {
            true => Total::Exactly(number),
            false => Total::AtLeast(number),
        })
    }

    async fn with_counts(&self, rows: &[DbRow]) -> Result<Vec<Batch>> {
        if rows.is_empty() {
            return Ok(Vec::new());
        }
        let ids = rows.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
        let counts = sql!(fetch_all, &self.readers,
            concat!(
                "SELECT batch_id AS id, state, COUNT(*) AS jobs FROM jobs WHERE batch_id",
                in_list!("$1"),
                " GROUP BY batch_id, state"
            );
            to_json(&ids)?
        )?;
        let mut states: HashMap<Uuid, BTreeMap<State, u64>> = HashMap::new();
        for row in &counts {
            let of_batch = states.entry(read_id(row)?).or_default();
            of_batch.insert(read_state(row)?, read_count(row, "jobs")?);
        }
        let read = |(row, id): (&DbRow, Uuid)| {
            let counted = states.get(&id);
            let number = |state| counted.and_then(|states| states.get(&state)).copied();
            Ok(Batch {
                id,
                tenant: row.try_get("tenant")?,
                kind: read_kind(row)?,
                created_at: row.try_get("created_at")?,
                count: read_small(row, "count")?,
                rejected: read_small(row, "rejected")?,
                name: row.try_get("name")?,
                labels: read_json(row, "labels")?,
                last_ended_at: row.try_get("ended_at")?,
                states: State::ALL
                    .into_iter()
                    .map(|state| (state, number(state).unwrap_or(0)))
                    .collect(),
            })
        };
        rows.iter().zip(ids).map(read).collect()
    }
}

/// The statement of a page. A tenant has far fewer batches than jobs, so its batches are scanned from the newest.
pub(crate) fn page_text(columns: &str, filter: &Filter) -> String {
    let name = match filter.name {
        Some(_) => and_name!("$5"),
        None => "",
    };
    let labels = match filter.labels.is_empty() {
        true => "",
        false => and_labels!(
            "$6",
            "SELECT 1 FROM ",
            pairs_of_labels!(),
            " AS label WHERE label.key = wanted_key AND label.value = wanted_value"
        ),
    };
    format!(
        "SELECT {columns} FROM batches WHERE complete = 1 AND tenant = $1 AND kind = $2 \
         AND id >= $3 AND id <= $4{name}{labels} ORDER BY id DESC LIMIT $7"
    )
}

/// In rows of chunks, `field_patches` is the number of rows without an answer.
const GET_RUN: &str = "SELECT body, head, \
     (SELECT CAST(COALESCE(SUM(field_patches), 0) AS bigint) FROM jobs WHERE batch_id = batches.id AND state = 'succeeded') AS without_answer, \
     (SELECT CAST(COUNT(*) AS bigint) FROM jobs WHERE batch_id = batches.id AND state IN ('failed', 'cancelled') \
      AND batch_index = (SELECT MAX(batch_index) FROM jobs WHERE batch_id = batches.id)) AS last_lost, \
     (SELECT CAST(COALESCE(SUM(progress), 0.0) AS double precision) FROM jobs WHERE batch_id = batches.id AND state = 'running') AS running \
     FROM batches JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
     WHERE batches.id = $1 AND batches.tenant = $2 AND kind = 'rows' AND complete = 1";
