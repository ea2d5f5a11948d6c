//! Calls of clients for single jobs, and lists of jobs.
use std::cmp::Reverse;

use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, release_blobs};
use super::engine::{self, DbRow, Row, SqlStore, built, query};
use super::rows::{
    GET, and_labels, and_name, job_columns, read_blob_id, read_blob_ids, read_bytes, read_count,
    read_flag, read_id, read_job, read_kind, read_optional_bytes, read_optional_id, read_result,
    read_small, to_json,
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
            let walk = Walk {
                tenant,
                filter,
                state,
                after,
            };
            // One job more than requested is read, which shows whether there is a next page.
            let rows = self.walk(&walk, walk.page(), i64::from(limit) + 1).await?;
            for row in &rows {
                jobs.push(read_job(row)?);
            }
            if filter.reads_jobs() {
                let end = walk.text("id") + " LIMIT 1 OFFSET $9";
                let end = self.walk(&walk, end, EXAMINED_MAX - 1).await?;
                looked_to = looked_to.max(end.first().map(read_id).transpose()?);
            }
        }
        jobs.sort_unstable_by_key(|job| Reverse(job.id));
        // Below this id, not every state was examined.
        jobs.retain(|job| looked_to.is_none_or(|to| job.id >= to));
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
            let walk = Walk {
                tenant,
                filter,
                state,
                after: None,
            };
            let counted = match restricted {
                true => {
                    let counted = walk.text("id");
                    format!("SELECT COUNT(*) AS number FROM ({counted} LIMIT $9) AS counted")
                }
                false => COUNT.to_owned(),
            };
            let rows = self.walk(&walk, counted, COUNTED).await?;
            let number = read_count(&rows[0], "number")?;
            all &= !restricted || number < COUNTED.unsigned_abs();
            total += number;
        }
        Ok(match all {
            true => Total::Exactly(total),
            false => Total::AtLeast(total),
        })
    }

    /// Runs a statement with the parameters of [`Walk::text`]; $9 is `most`.
    async fn walk(&self, walk: &Walk<'_>, text: String, most: i64) -> Result<Vec<DbRow>> {
        let filter = walk.filter;
        let label = filter.labels.first();
        Ok(sql!(built fetch_all, &self.readers,
            text;
            walk.tenant, filter.kind.name(), label.map(|(key, _)| key), label.map(|(_, value)| value),
            filter.batch().map(|id| id.to_string()), walk.state.map(State::name), filter.first_id(),
            filter.last_id(walk.after), most, filter.updated_after, filter.lower_name(),
            to_json(filter.labels.get(1..).unwrap_or_default())?
        )?)
    }
}

const COUNT: &str = "SELECT CAST(COALESCE(SUM(number), 0) AS bigint) AS number FROM job_counts \
     WHERE tenant = $1 AND kind = $2 AND ($6 IS NULL OR state = $6)";

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

/// A scan of the jobs of a filter, from the newest, as far as an index covers the filter. Labels have a separate table, sorted
/// by job within each label, so that every list scans an index and stops at its limit.
pub(crate) struct Walk<'a> {
    pub(crate) tenant: &'a str,
    pub(crate) filter: &'a Filter,
    /// The state of the jobs; `None` for all states.
    pub(crate) state: Option<State>,
    /// The last job of the page before.
    pub(crate) after: Option<Uuid>,
}

impl Walk<'_> {
    /// The statement of one page.
    pub(crate) fn page(&self) -> String {
        let filter = self.filter;
        let walked = self.text(job_columns!());
        if !filter.reads_jobs() {
            return walked + " LIMIT $9";
        }
        let mut page = format!(
            "SELECT {} FROM ({walked} LIMIT {EXAMINED_MAX}) AS examined WHERE TRUE",
            job_columns!()
        );
        let conditions = [
            (filter.alone(), " AND batch_id IS NULL"),
            (filter.updated_after.is_some(), " AND updated_at >= $10"),
            (filter.name.is_some(), and_name!("$11")),
            (
                filter.labels.len() > 1,
                and_labels!(
                    "$12",
                    "SELECT 1 FROM job_labels WHERE of_tenant = $1 AND key = wanted_key \
                     AND value = wanted_value AND job_id = examined.id"
                ),
            ),
        ];
        let conditions = conditions.iter().filter(|(given, _)| *given);
        page.extend(conditions.map(|(_, condition)| *condition));
        page + " ORDER BY id DESC LIMIT $9"
    }

    /// The statement that reads these columns of all jobs, without a limit.
    pub(crate) fn text(&self, columns: &str) -> String {
        let labelled = !self.filter.labels.is_empty();
        let (source, id, owner) = match (labelled, self.filter.batch()) {
            (true, Some(_)) => (LABELLED, "job_id", OF_LABEL_AND_BATCH),
            (true, None) => (LABELLED, "job_id", OF_LABEL),
            (false, Some(_)) => ("jobs", "id", OF_BATCH),
            (false, None) => ("jobs", "id", "tenant = $1"),
        };
        let state = match self.state {
            None => "",
            Some(_) if labelled => " AND label_state = $6",
            Some(_) => " AND state = $6",
        };
        let alone = match !labelled && self.filter.alone() {
            true => " AND batch_id IS NULL",
            false => "",
        };
        let within_batch = labelled && self.filter.batch().is_some();
        let bounds = [
            (self.filter.created_after.is_some(), ">= $7"),
            (
                self.after.is_some() || self.filter.created_before.is_some(),
                "<= $8",
            ),
        ];
        let bounds = bounds.iter().filter(|(given, _)| *given && !within_batch);
        let bounds: String = bounds
            .map(|(_, bound)| format!(" AND {id} {bound}"))
            .collect();
        format!(
            "SELECT {columns} FROM {source} WHERE {owner} AND kind = $2{state}{alone}{bounds} ORDER BY {id} DESC"
        )
    }
}

const LABELLED: &str = "(SELECT of_tenant, key, value, job_id, state AS label_state FROM job_labels) AS job_labels \
     JOIN jobs ON jobs.id = job_id";

const OF_LABEL: &str = "of_tenant = $1 AND key = $3 AND value = $4";

/// Within a batch an index of the batch is used: the expression excludes the index of the tenant. A batch of another tenant
/// yields no rows.
const OF_BATCH: &str = concat!(
    bare!("tenant"),
    " = $1 AND batch_id = (SELECT id FROM batches WHERE id = $5 AND tenant = $1)"
);

/// The first and last id of the batch are bounds too, so that only this part of the index of the label is scanned.
const OF_LABEL_AND_BATCH: &str = concat!(
    "of_tenant = $1 AND key = $3 AND value = $4 AND ",
    bare!("batch_id"),
    " = (SELECT id FROM batches WHERE id = $5 AND tenant = $1) AND job_id >= ",
    greatest!(),
    "($7, (SELECT MIN(id) FROM jobs WHERE batch_id = $5)) AND job_id <= ",
    least!(),
    "($8, (SELECT MAX(id) FROM jobs WHERE batch_id = $5))"
);
