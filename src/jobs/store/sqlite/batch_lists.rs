//! Lists of batches, newest first, with the numbers of their jobs.

use std::collections::{BTreeMap, HashMap};

use sqlx::sqlite::SqliteRow;
use sqlx::{QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::batch::model::Batch;
use crate::jobs::model::State;
use crate::jobs::store::error::StoreError;
use crate::jobs::store::list::{BatchFilter, Page, Total, first_id_at};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{from_json, push_list, read_count, read_id, read_state};

/// Most batches that are looked at for one page, and how far they are counted.
const LOOKED_AT: u32 = 10_000;

/// The columns a [`Batch`] is read from.
const COLUMNS: &str = "id, tenant, created_at, count, rejected, name, labels, ended_at";

impl SqliteStore {
    /// One page of the batches of a tenant, newest first.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn batches(
        &self,
        tenant: &str,
        filter: &BatchFilter,
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

    /// An acknowledged batch with its counts.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn batch(&self, tenant: &str, id: Uuid) -> Result<Option<Batch>, StoreError> {
        let mut query = QueryBuilder::<Sqlite>::new("SELECT ");
        query
            .push(COLUMNS)
            .push(" FROM batches WHERE complete = 1 AND id = ");
        query
            .push_bind(id.to_string())
            .push(" AND tenant = ")
            .push_bind(tenant);
        let rows = query.build().fetch_all(&self.readers).await?;
        Ok(self.with_counts(&rows).await?.pop())
    }

    async fn count_batches(&self, tenant: &str, filter: &BatchFilter) -> Result<Total, StoreError> {
        let mut query = QueryBuilder::<Sqlite>::new("SELECT COUNT(*) AS number FROM (");
        push_page(&mut query, "id", tenant, filter, None);
        query.push(" LIMIT ").push_bind(LOOKED_AT).push(")");
        let row = query.build().fetch_one(&self.readers).await?;
        let number = read_count(&row, "number")?;
        Ok(match number < u64::from(LOOKED_AT) {
            true => Total::Exactly(number),
            false => Total::AtLeast(number),
        })
    }

    async fn with_counts(&self, rows: &[SqliteRow]) -> Result<Vec<Batch>, StoreError> {
        if rows.is_empty() {
            return Ok(Vec::new());
        }
        let ids = rows.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
        let mut query = QueryBuilder::<Sqlite>::new(
            "SELECT batch_id AS id, state, COUNT(*) AS jobs FROM jobs WHERE batch_id IN (",
        );
        push_list(&mut query, &ids);
        query.push(") GROUP BY batch_id, state");
        let mut states: HashMap<Uuid, BTreeMap<State, u64>> = HashMap::new();
        for row in &query.build().fetch_all(&self.readers).await? {
            let of_batch = states.entry(read_id(row)?).or_default();
            of_batch.insert(read_state(row)?, read_count(row, "jobs")?);
        }
        let read = |(row, id): (&SqliteRow, Uuid)| {
            let counted = states.get(&id);
            let number = |state| counted.and_then(|states| states.get(&state)).copied();
            Ok(Batch {
                id,
                tenant: row.try_get("tenant")?,
                created_at: row.try_get("created_at")?,
                count: row.try_get("count")?,
                rejected: row.try_get("rejected")?,
                name: row.try_get("name")?,
                labels: from_json(row.try_get("labels")?)?,
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

fn page_query(tenant: &str, filter: &BatchFilter, after: Option<Uuid>) -> QueryBuilder<Sqlite> {
    let mut query = QueryBuilder::new("");
    push_page(&mut query, COLUMNS, tenant, filter, after);
    query
}

/// Batches are few beside jobs: those of the tenant are walked from the newest.
fn push_page(
    query: &mut QueryBuilder<Sqlite>,
    columns: &str,
    tenant: &str,
    filter: &BatchFilter,
    after: Option<Uuid>,
) {
    query.push("SELECT ").push(columns);
    query.push(" FROM batches WHERE complete = 1 AND tenant = ");
    query.push_bind(tenant.to_owned());
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
        query.push(" AND instr(lower(COALESCE(name, '')), ");
        query.push_bind(name.to_ascii_lowercase()).push(") > 0");
    }
    for (key, value) in &filter.labels {
        query.push(" AND EXISTS (SELECT 1 FROM json_each(labels) AS label WHERE label.key = ");
        query.push_bind(key.clone()).push(" AND label.value = ");
        query.push_bind(value.clone()).push(")");
    }
    query.push(" ORDER BY id DESC");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn the_list_of_batches_walks_its_index_without_sorting() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for after in [None, Some(Uuid::now_v7())] {
            let filter = BatchFilter {
                labels: vec![("line".to_owned(), "A12".to_owned())],
                name: Some("x".to_owned()),
                ..BatchFilter::default()
            };
            let query = page_query("t", &filter, after);
            let steps = plan(&store, query.sql().as_str()).await;
            assert!(
                steps[0].contains("batches_by_tenant (tenant=?"),
                "{steps:?}"
            );
            let sorts = |step: &String| step.contains("TEMP B-TREE");
            assert!(!steps.iter().any(sorts), "{steps:?}");
        }
    }
}
