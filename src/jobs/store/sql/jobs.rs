//! Calls of clients for single jobs, and lists of jobs.
use std::cmp::Reverse;

use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, DbRow, QueryBuilder, Row, SqlStore, query};
use super::rows::{
    GET, job_columns, push_name, read_blob_id, read_blob_ids, read_bytes, read_count, read_flag,
    read_id, read_job, read_kind, read_optional_bytes, read_optional_id, read_result, read_small,
};
use crate::model::{Job, State};
use crate::store::{Change, Filter, Page, Result, ResultRef, StoredCase, Total};

/// Calls of clients for single jobs.
#[store_trait]
impl ClientJobs for SqlStore {
    /// Cancels a queued job at once, and marks a running one for cancellation; an ended job does not change. Returns the
    /// new state of the job.
    async fn cancel(&self, tenant: &str, id: Uuid, now: i64) -> Result<Option<Job>> {
        let mut transaction = engine::begin(&self.writer).await?;
        let row = sql!(fetch_all, &mut *transaction,
            concat!(
                "UPDATE jobs SET state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
                 ended_at = CASE WHEN state = 'queued' THEN $1 ELSE NULL END, \
                 cancel_requested = 1, version = version + 1, updated_at = $1 \
                 WHERE id = $2 AND tenant = $3 AND kind <> 'rows' AND cancel_requested = 0 AND state IN ('queued', 'running') RETURNING ",
                job_columns!(),
                ", slices"
            );
            now, id.to_string(), tenant
        )?;
        drop_slices_of_ended(&mut transaction, &row).await?;
        transaction.commit().await?;
        match row.first() {
            Some(row) => read_job(row).map(Some),
            None => self.job(tenant, id).await,
        }
    }

    /// Removes an ended job with everything that belongs to it; its blob is removed with the last reference. `false` if the
    /// job does not exist or has not ended.
    async fn delete(&self, tenant: &str, id: Uuid) -> Result<bool> {
        let mut transaction = engine::begin(&self.writer).await?;
        let gone = sql!(fetch_all, &mut *transaction,
            "DELETE FROM jobs WHERE id = $1 AND tenant = $2 AND kind <> 'rows' AND state IN ('succeeded', 'failed', 'cancelled') RETURNING blob_id";
            id.to_string(), tenant
        )?;
        release_blobs(&mut transaction, read_blob_ids(&gone)?).await?;
        transaction.commit().await?;
        Ok(!gone.is_empty())
    }

    /// Reads a job.
    async fn job(&self, tenant: &str, id: Uuid) -> Result<Option<Job>> {
        let row = sql!(fetch_optional, &self.readers, GET; id.to_string(), tenant)?;
        row.as_ref().map(read_job).transpose()
    }

    /// Reads a job with its result, or with the key of its result if that is large.
    async fn result(&self, tenant: &str, id: Uuid) -> Result<Option<(Job, Option<ResultRef>)>> {
        let row = sql!(fetch_optional, &self.readers,
            concat!(
                "SELECT ",
                job_columns!(),
                ", blob_id, field_patches, outputs, blob_key, blob_bytes, solution, fields FROM jobs LEFT JOIN \
                 (SELECT id AS blob, key AS blob_key, bytes AS blob_bytes, solution, fields FROM blobs) AS stored ON blob = blob_id \
                 WHERE id = $1 AND tenant = $2 AND kind <> 'rows'"
            );
            id.to_string(), tenant
        )?;
        let Some(row) = row else { return Ok(None) };
        let job = read_job(&row)?;
        if read_blob_id(&row)?.is_none() {
            return Ok(Some((job, None)));
        }
        let patches: u32 = read_small(&row, "field_patches")?;
        let stored = ResultRef {
            result: read_result(&row)?,
            field_patches: patches as usize,
            outputs: row.try_get("outputs")?,
        };
        Ok(Some((job, Some(stored))))
    }

    /// Reads the case of a job as submitted.
    async fn case(&self, tenant: &str, id: Uuid) -> Result<Option<StoredCase>> {
        let row = sql!(fetch_optional, &self.readers,
            "SELECT jobs.kind, cases.row, cases.body, head, templates.body AS template FROM jobs JOIN cases ON cases.job_id = jobs.id \
             LEFT JOIN batches ON batches.id = jobs.batch_id \
             LEFT JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
             WHERE jobs.id = $1 AND jobs.tenant = $2";
            id.to_string(), tenant
        )?;
        let Some(row) = row else { return Ok(None) };
        let template = match read_flag(&row, "row")? {
            true => read_optional_bytes(&row, "template")?,
            false => None,
        };
        Ok(Some(StoredCase {
            kind: read_kind(&row)?,
            template,
            head: read_optional_bytes(&row, "head")?,
            body: read_bytes(&row, "body")?,
        }))
    }

    /// One page of the jobs of a tenant, newest first, starting with the first one older than `after`. The number of rows
    /// read is bounded.
    async fn list(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Job>> {
        let (mut jobs, mut looked_to) = (Vec::new(), None);
        for state in walked(filter) {
            let mut query = page_query(tenant, filter, state, after, limit);
            for row in &query.build().fetch_all(&self.readers).await? {
                jobs.push(read_job(row)?);
            }
            if filter.reads_jobs() {
                let mut query = walk("", "id", tenant, filter, state, after);
                query.push(" LIMIT 1 OFFSET ").push_bind(EXAMINED_MAX - 1);
                let end = query.build().fetch_optional(&self.readers).await?;
                looked_to = looked_to.max(end.as_ref().map(read_id).transpose()?);
            }
        }
        jobs.sort_unstable_by_key(|job| Reverse(job.id));
        // Below this id, not every state was examined.
        jobs.retain(|job| looked_to.is_none_or(|to| job.id >= to));
        // One job more than requested was read, which shows whether there is a next page.
        let more = jobs.len() > limit as usize;
        jobs.truncate(limit as usize);
        let last = if more {
            jobs.last().map(|job| job.id)
        } else {
            looked_to
        };
        Ok(Page {
            next_cursor: last.map(|last| filter.cursor_after(last)),
            total: match filter.reads_jobs() {
                true => Total::AtLeast(jobs.len() as u64),
                false => self.count(tenant, filter).await?,
            },
            entries: jobs,
        })
    }

    /// Jobs of a tenant that changed after `since`, not counting progress, ordered by time of the change and id. Of the
    /// jobs that changed at `since`, those after the job `after` are included.
    async fn changes(
        &self,
        tenant: &str,
        since: i64,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<Change>> {
        let rows = sql!(fetch_all, &self.readers,
            CHANGES;
            tenant, since, after.map_or_else(String::new, |id| id.to_string()), i64::from(limit)
        )?;
        let change = |row: &DbRow| {
            Ok(Change {
                id: read_id(row)?,
                batch: read_optional_id(row, "batch_id")?,
                kind: read_kind(row)?,
                at: row.try_get("updated_at")?,
            })
        };
        rows.iter().map(change).collect()
    }
}

/// Maximum number of jobs that are examined for one page without a suitable index.
const EXAMINED_MAX: i64 = 20_000;
/// Limit up to which the jobs of a list are counted.
const COUNTED: i64 = 1_000;

impl SqlStore {
    async fn count(&self, tenant: &str, filter: &Filter) -> Result<Total> {
        let restricted = filter.member.is_some()
            || !filter.labels.is_empty()
            || filter.created_after.or(filter.created_before).is_some();
        let (mut total, mut all) = (0, true);
        for state in walked(filter) {
            let row = if restricted {
                let counted = "SELECT COUNT(*) AS number FROM (";
                let mut query = walk(counted, "id", tenant, filter, state, None);
                query.push(" LIMIT ").push_bind(COUNTED);
                query.push(") AS counted");
                query.build().fetch_one(&self.readers).await?
            } else {
                sql!(fetch_one, &self.readers,
                    "SELECT CAST(COALESCE(SUM(number), 0) AS bigint) AS number FROM job_counts \
                     WHERE tenant = $1 AND kind = $2 AND ($3 IS NULL OR state = $3)";
                    tenant, filter.kind.name(), state.map(State::name)
                )?
            };
            let number = read_count(&row, "number")?;
            all &= !restricted || number < COUNTED.unsigned_abs();
            total += number;
        }
        Ok(match all {
            true => Total::Exactly(total),
            false => Total::AtLeast(total),
        })
    }
}

const CHANGES: &str = "SELECT id, batch_id, kind, updated_at FROM jobs WHERE tenant = $1 AND (updated_at, id) > ($2, $3) \
     ORDER BY updated_at, id LIMIT $4";

/// The states whose jobs are read one after the other; `None` means all states.
fn walked(filter: &Filter) -> Vec<Option<State>> {
    let all = State::ALL.iter().all(|state| filter.states.contains(state));
    match filter.states.is_empty() || all {
        // The index of jobs that were submitted alone begins with the state.
        true if filter.alone() => State::ALL.map(Some).to_vec(),
        true => vec![None],
        false => filter.states.iter().copied().map(Some).collect(),
    }
}

/// The statement of one page of the jobs in one state, or in all states.
pub(crate) fn page_query(
    tenant: &str,
    filter: &Filter,
    state: Option<State>,
    after: Option<Uuid>,
    limit: u32,
) -> QueryBuilder {
    let most = i64::from(limit) + 1;
    if !filter.reads_jobs() {
        let mut query = walk("", job_columns!(), tenant, filter, state, after);
        query.push(" LIMIT ").push_bind(most);
        return query;
    }
    let examined = concat!("SELECT ", job_columns!(), " FROM (");
    let mut query = walk(examined, job_columns!(), tenant, filter, state, after);
    query.push(" LIMIT ").push_bind(EXAMINED_MAX);
    query.push(") AS examined WHERE TRUE");
    if filter.alone() {
        query.push(" AND batch_id IS NULL");
    }
    if let Some(time) = filter.updated_after {
        query.push(" AND updated_at >= ").push_bind(time);
    }
    push_name(&mut query, filter.name.as_ref());
    for (key, value) in filter.labels.iter().skip(1) {
        query.push(" AND EXISTS (SELECT 1 FROM job_labels WHERE of_tenant = ");
        query.push_bind(tenant.to_owned()).push(" AND key = ");
        query.push_bind(key.clone()).push(" AND value = ");
        query.push_bind(value.clone());
        query.push(" AND job_id = examined.id)");
    }
    query.push(" ORDER BY id DESC LIMIT ").push_bind(most);
    query
}

/// Scans the jobs of a filter, from the newest, as far as an index covers the filter. Labels have a separate
/// table, sorted by job within each label, so that every list scans an index and stops at its limit.
fn walk(
    front: &str,
    columns: &str,
    tenant: &str,
    filter: &Filter,
    state: Option<State>,
    after: Option<Uuid>,
) -> QueryBuilder {
    let label = filter.labels.first();
    let (source, id) = match label {
        Some(_) => (
            " FROM (SELECT of_tenant, key, value, job_id, state AS label_state FROM job_labels) AS job_labels JOIN jobs ON jobs.id = job_id",
            "job_id",
        ),
        None => (" FROM jobs", "id"),
    };
    let mut all = QueryBuilder::new(front);
    let query = &mut all;
    query.push("SELECT ").push(columns).push(source);
    let mut joint = " WHERE ";
    let mut and = |query: &mut QueryBuilder, condition: &str, value: String| {
        query.push(joint).push(condition).push_bind(value);
        joint = " AND ";
    };
    // Within a batch an index of the batch is used: the expression excludes the index of the tenant.
    let owner = match (label, filter.batch()) {
        (Some(_), _) => "of_tenant = ",
        (None, Some(_)) => concat!(bare!("tenant"), " = "),
        (None, None) => "tenant = ",
    };
    and(query, owner, tenant.to_owned());
    and(query, "kind = ", filter.kind.name().to_owned());
    if let Some((key, value)) = label {
        and(query, "key = ", key.clone());
        and(query, "value = ", value.clone());
    }
    if let Some(batch) = filter.batch() {
        // A batch of another tenant yields no rows.
        let column = match label {
            Some(_) => concat!(bare!("batch_id"), " = (SELECT id FROM batches WHERE id = "),
            None => "batch_id = (SELECT id FROM batches WHERE id = ",
        };
        and(query, column, batch.to_string());
        query
            .push(" AND tenant = ")
            .push_bind(tenant.to_owned())
            .push(")");
    }
    if let Some(state) = state {
        let column = match label {
            Some(_) => "label_state = ",
            None => "state = ",
        };
        and(query, column, state.name().to_owned());
    }
    // Of several upper bounds only the smallest is used, so that the index has one starting point.
    let before = [after, filter.id_before()].into_iter().flatten().min();
    if label.is_none() && filter.alone() {
        query.push(" AND batch_id IS NULL");
    }
    if let (Some(_), Some(batch)) = (label, filter.batch()) {
        within_batch(query, batch, filter.id_from(), before);
    } else {
        if let Some(first) = filter.id_from() {
            and(query, &format!("{id} >= "), first.to_string());
        }
        if let Some(before) = before {
            and(query, &format!("{id} < "), before.to_string());
        }
    }
    query.push(format!(" ORDER BY {id} DESC"));
    all
}

/// Adds bounds from the first and last id of the batch, so that only this part of the label's index is scanned.
fn within_batch(query: &mut QueryBuilder, batch: Uuid, from: Option<Uuid>, before: Option<Uuid>) {
    let end = "(SELECT MAX(id) FROM jobs WHERE batch_id = ";
    let last = before.map_or(Uuid::max(), |id| {
        Uuid::from_u128(id.as_u128().saturating_sub(1))
    });
    query.push(concat!(" AND job_id >= ", greatest!(), "("));
    query.push_bind(from.unwrap_or_default().to_string());
    query.push(", ").push(end.replace("MAX", "MIN"));
    query.push_bind(batch.to_string());
    query.push(concat!(")) AND job_id <= ", least!(), "("));
    query.push_bind(last.to_string());
    query.push(", ").push(end).push_bind(batch.to_string());
    query.push("))");
}
