//! Lists of the embedded job table: one indexed statement per page, whatever the filter.

use sqlx::{QueryBuilder, Sqlite};
use uuid::Uuid;

use crate::jobs::store::error::StoreError;
use crate::jobs::store::list::{Filter, Page};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::{job_columns, read_job};

impl SqliteStore {
    /// One page of the list of a tenant, newest first, at most `limit` jobs.
    ///
    /// # Errors
    /// The cursor is not one of this filter, or the database failed.
    pub(crate) async fn list(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page, StoreError> {
        let mut query = page_query(tenant, filter, after, limit);
        let rows = query.build().fetch_all(&self.readers).await?;
        let mut jobs = rows.iter().map(read_job).collect::<Result<Vec<_>, _>>()?;
        // One row more than asked for was read: it says whether there is a next page.
        let more = jobs.len() > limit as usize;
        jobs.truncate(limit as usize);
        let next_cursor = jobs
            .last()
            .filter(|_| more)
            .map(|job| filter.cursor_after(job.id));
        Ok(Page { jobs, next_cursor })
    }
}

/// The statement of one page. Labels have a table of their own, sorted by job within each label, so that every kind of list
/// walks an index from its newest entry and stops at the limit.
fn page_query(
    tenant: &str,
    filter: &Filter,
    after: Option<Uuid>,
    limit: u32,
) -> QueryBuilder<Sqlite> {
    let (source, id) = match filter.label {
        Some(_) => (
            " FROM (SELECT of_tenant, key, value, job_id, state AS label_state FROM job_labels) AS job_labels JOIN jobs ON jobs.id = job_id",
            "job_id",
        ),
        None => (" FROM jobs", "id"),
    };
    let mut query = QueryBuilder::<Sqlite>::new(concat!("SELECT ", job_columns!()));
    query.push(source);
    let mut joint = " WHERE ";
    let mut and = |query: &mut QueryBuilder<Sqlite>, condition: &str, value: String| {
        query.push(joint).push(condition).push_bind(value);
        joint = " AND ";
    };
    // Within a batch one of its indices is walked, not that of the tenant: a bare expression keeps that out.
    let owner = match (&filter.label, filter.batch) {
        (Some(_), _) => "of_tenant = ",
        (None, Some(_)) => "tenant || '' = ",
        (None, None) => "tenant = ",
    };
    and(&mut query, owner, tenant.to_owned());
    if let Some((key, value)) = &filter.label {
        and(&mut query, "key = ", key.clone());
        and(&mut query, "value = ", value.clone());
    }
    if let Some(batch) = filter.batch {
        // Nothing of a batch of another tenant is walked.
        let column = match filter.label {
            Some(_) => "batch_id || '' = (SELECT id FROM batches WHERE id = ",
            None => "batch_id = (SELECT id FROM batches WHERE id = ",
        };
        and(&mut query, column, batch.to_string());
        query
            .push(" AND tenant = ")
            .push_bind(tenant.to_owned())
            .push(")");
    }
    if let Some(state) = filter.state {
        let column = match (&filter.label, filter.batch) {
            (Some(_), _) => "label_state = ",
            (None, _) => "state = ",
        };
        and(&mut query, column, state.name().to_owned());
    }
    // Of several bounds only the closest is passed on, so that the index is entered at one place.
    let before = [after, filter.id_before()].into_iter().flatten().min();
    if let (Some(_), Some(batch)) = (&filter.label, filter.batch) {
        within_batch(&mut query, batch, filter.id_from(), before);
    } else {
        if let Some(first) = filter.id_from() {
            and(&mut query, &format!("{id} >= "), first.to_string());
        }
        if let Some(before) = before {
            and(&mut query, &format!("{id} < "), before.to_string());
        }
    }
    query.push(format!(" ORDER BY {id} DESC LIMIT "));
    query.push_bind(i64::from(limit) + 1);
    query
}

/// Ids within a batch lie between its first and its last, so no more of a label is walked than was sent meanwhile.
fn within_batch(
    query: &mut QueryBuilder<Sqlite>,
    batch: Uuid,
    from: Option<Uuid>,
    before: Option<Uuid>,
) {
    let end = "(SELECT MAX(id) FROM jobs WHERE batch_id = ";
    let last = before.map_or(Uuid::max(), |id| {
        Uuid::from_u128(id.as_u128().saturating_sub(1))
    });
    query.push(" AND job_id >= MAX(");
    query.push_bind(from.unwrap_or_default().to_string());
    query.push(", ").push(end.replace("MAX", "MIN"));
    query.push_bind(batch.to_string());
    query.push(")) AND job_id <= MIN(");
    query.push_bind(last.to_string());
    query.push(", ").push(end).push_bind(batch.to_string());
    query.push("))");
}

#[cfg(test)]
pub(crate) mod tests {
    use sqlx::{AssertSqlSafe, Row};

    use super::*;
    use crate::jobs::model::State;

    /// The steps SQLite takes for a statement.
    pub(crate) async fn plan(store: &SqliteStore, statement: &str) -> Vec<String> {
        sqlx::query(AssertSqlSafe(format!("EXPLAIN QUERY PLAN {statement}")))
            .fetch_all(&store.writer)
            .await
            .unwrap()
            .iter()
            .map(|row| row.get("detail"))
            .collect()
    }

    #[tokio::test]
    async fn the_list_of_a_batch_walks_its_index_and_nothing_of_the_batch_of_another_tenant() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for (state, after) in [(None, None), (Some(State::Queued), Some(Uuid::now_v7()))] {
            let filter = Filter {
                state,
                batch: Some(Uuid::now_v7()),
                ..Filter::default()
            };
            let query = page_query("t", &filter, after, 50);
            let steps = plan(&store, query.sql().as_str()).await;
            let seek = match state {
                None => "jobs_by_batch (batch_id=?",
                Some(_) => "jobs_by_batch_and_state (batch_id=? AND state=?",
            };
            assert!(steps[0].contains(seek), "{steps:?}");
            // The batch is sought first, among those of the tenant: of another tenant's nothing is walked.
            let owner = [
                "SCALAR SUBQUERY 1",
                "SEARCH batches USING PRIMARY KEY (id=?)",
            ];
            assert_eq!(steps[1..], owner, "{steps:?}");
        }
    }

    #[tokio::test]
    async fn a_label_within_a_batch_is_walked_no_further_than_the_batch_goes() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        for (state, after) in [(None, Some(Uuid::now_v7())), (Some(State::Failed), None)] {
            let filter = Filter {
                state,
                batch: Some(Uuid::now_v7()),
                label: Some(("line".to_owned(), "A12".to_owned())),
                ..Filter::default()
            };
            let query = page_query("t", &filter, after, 50);
            let steps = plan(&store, query.sql().as_str()).await;
            assert!(steps[0].contains("job_id>? AND job_id<?)"), "{steps:?}");
            let ends = steps.iter().filter(|step| step.contains("(batch_id=?)"));
            assert_eq!(ends.count(), 2, "{steps:?}");
            let scans = |step: &String| step.starts_with("SCAN") || step.contains("TEMP B-TREE");
            assert!(!steps.iter().any(scans), "{steps:?}");
        }
    }

    #[tokio::test]
    async fn every_form_of_the_list_walks_an_index_without_sorting() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        let label = Some(("line".to_owned(), "A12".to_owned()));
        for state in [None, Some(State::Queued)] {
            for label in [None, label.clone()] {
                for window in [None, Some(1_000_000)] {
                    for after in [None, Some(Uuid::now_v7())] {
                        let filter = Filter {
                            state,
                            batch: None,
                            label: label.clone(),
                            created_after: window,
                            created_before: window.map(|time| time + 5),
                        };
                        let query = page_query("t", &filter, after, 50);
                        let steps = plan(&store, query.sql().as_str()).await;
                        assert!(
                            !steps.iter().any(|step| step.contains("TEMP B-TREE")),
                            "{filter:?}: {steps:?}"
                        );
                        assert!(
                            !steps.iter().any(|step| step.starts_with("SCAN")),
                            "{filter:?}: {steps:?}"
                        );
                        let seek = match (&label, state) {
                            (None, None) => "jobs_by_tenant (tenant=?",
                            (None, Some(_)) => "jobs_by_state (state=? AND tenant=?",
                            (Some(_), None) => "PRIMARY KEY (of_tenant=? AND key=? AND value=?",
                            (Some(_), Some(_)) => {
                                "job_labels_by_state (of_tenant=? AND key=? AND value=? AND state=?"
                            }
                        };
                        assert!(steps[0].contains(seek), "{steps:?}");
                    }
                }
            }
        }
    }
}
