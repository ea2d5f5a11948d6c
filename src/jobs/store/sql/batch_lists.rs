//! Lists of batches, newest first, with the numbers of their jobs.

use super::engine::{self, DbRow, QueryBuilder, Row, SqlStore, query};
use super::rows::{push_list, read_count, read_id, read_json, read_kind, read_small, read_state};
use std::collections::{BTreeMap, HashMap};

use bytes::Bytes;
use uuid::Uuid;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::batch::{Batch, RunRecord};
use crate::jobs::model::job::State;
use crate::jobs::model::kind::Kind;
use crate::jobs::store::BatchLists;
use crate::jobs::store::list::{Filter, Page, Total, first_id_at};
use crate::jobs::store_error::StoreError;

/// Most batches that are examined for one page, and how far they are counted.
const EXAMINED_MAX: i64 = 10_000;

/// The columns a [`Batch`] is read from.
const COLUMNS: &str = "id, tenant, kind, created_at, count, rejected, name, labels, ended_at";

impl SqlStore {
    async fn count_batches(&self, tenant: &str, filter: &Filter) -> Result<Total, StoreError> {
        let mut query = QueryBuilder::new("SELECT COUNT(*) AS number FROM (");
        push_page(&mut query, "id", tenant, filter, None);
        query.push(" LIMIT ").push_bind(EXAMINED_MAX);
        query.push(") AS counted");
        let row = query.build().fetch_one(&self.readers).await?;
        let number = read_count(&row, "number")?;
        Ok(match number < EXAMINED_MAX.unsigned_abs() {
            true => Total::Exactly(number),
            false => Total::AtLeast(number),
        })
    }

    async fn with_counts(&self, rows: &[DbRow]) -> Result<Vec<Batch>, StoreError> {
        if rows.is_empty() {
            return Ok(Vec::new());
        }
        let ids = rows.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
        let mut query = QueryBuilder::new(
            "SELECT batch_id AS id, state, COUNT(*) AS jobs FROM jobs WHERE batch_id IN (",
        );
        push_list(&mut query, &ids);
        query.push(") GROUP BY batch_id, state");
        let mut states: HashMap<Uuid, BTreeMap<State, u64>> = HashMap::new();
        for row in &query.build().fetch_all(&self.readers).await? {
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

pub(crate) fn page_query(tenant: &str, filter: &Filter, after: Option<Uuid>) -> QueryBuilder {
    let mut query = QueryBuilder::new("");
    push_page(&mut query, COLUMNS, tenant, filter, after);
    query
}

/// Batches are few beside jobs: those of the tenant are walked from the newest.
fn push_page(
    query: &mut QueryBuilder,
    columns: &str,
    tenant: &str,
    filter: &Filter,
    after: Option<Uuid>,
) {
    query.push("SELECT ").push(columns);
    query.push(" FROM batches WHERE complete = 1 AND tenant = ");
    query.push_bind(tenant.to_owned()).push(" AND kind = ");
    query.push_bind(filter.kind.name());
    if let Some(time) = filter.created_after {
        query
            .push(" AND id >= ")
            .push_bind(first_id_at(time).to_string());
    }
    let before = filter.created_before.map(first_id_at);
    if let Some(before) = [before, after].into_iter().flatten().min() {
        query.push(" AND id < ").push_bind(before.to_string());
    }
    if let Some(name) = &filter.name {
        query.push(concat!(
            " AND ",
            place_in!(),
            "(lower(COALESCE(name, '')), "
        ));
        query.push_bind(name.to_ascii_lowercase()).push(") > 0");
    }
    for (key, value) in &filter.labels {
        query.push(concat!(
            " AND EXISTS (SELECT 1 FROM ",
            pairs_of_labels!(),
            " AS label WHERE label.key = "
        ));
        query.push_bind(key.clone()).push(" AND label.value = ");
        query.push_bind(value.clone()).push(")");
    }
    query.push(" ORDER BY id DESC");
}

/// Of a chunk, `field_patches` counts the rows without an answer.
const GET_RUN: &str = "SELECT body, head, \
     (SELECT CAST(COALESCE(SUM(field_patches), 0) AS bigint) FROM jobs WHERE batch_id = batches.id AND state = 'succeeded') AS without_answer, \
     (SELECT CAST(COALESCE(SUM(progress), 0.0) AS double precision) FROM jobs WHERE batch_id = batches.id AND state = 'running') AS running \
     FROM batches JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
     WHERE batches.id = $1 AND batches.tenant = $2 AND kind = 'rows' AND complete = 1";

#[repeat_conflicts]
#[async_trait]
impl BatchLists for SqlStore {
    async fn batches(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Batch>, StoreError> {
        let mut query = page_query(tenant, filter, after);
        query.push(" LIMIT ").push_bind(i64::from(limit) + 1);
        let mut rows = query.build().fetch_all(&self.readers).await?;
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

    async fn batch(&self, tenant: &str, kind: Kind, id: Uuid) -> Result<Option<Batch>, StoreError> {
        let mut query = QueryBuilder::new("SELECT ");
        query
            .push(COLUMNS)
            .push(" FROM batches WHERE complete = 1 AND id = ");
        query
            .push_bind(id.to_string())
            .push(" AND tenant = ")
            .push_bind(tenant)
            .push(" AND kind = ")
            .push_bind(kind.name());
        let rows = query.build().fetch_all(&self.readers).await?;
        Ok(self.with_counts(&rows).await?.pop())
    }

    async fn run(&self, tenant: &str, id: Uuid) -> Result<Option<RunRecord>, StoreError> {
        let row = query(GET_RUN)
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        let Some(row) = row else { return Ok(None) };
        let template: Vec<u8> = row.try_get("body")?;
        let head: Option<Vec<u8>> = row.try_get("head")?;
        Ok(Some(RunRecord {
            template: template.into(),
            head: head.map(Bytes::from),
            without_answer: read_count(&row, "without_answer")?,
            running: row.try_get("running")?,
        }))
    }
}
