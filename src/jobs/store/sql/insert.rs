//! New rows of the embedded job table: jobs with their cases and labels, many in one statement.

use super::cached::end_with_sources;
use super::engine::{DbConnection, QueryBuilder};
use super::rows::{count, to_json};
use uuid::Uuid;

use crate::jobs::store::submission::{CacheKey, NewJob};
use crate::jobs::store_error::StoreError;

/// Jobs in one statement; with 20 values each far below the bound of SQLite.
const ROWS_PER_STATEMENT: usize = 250;

/// Queues jobs within the caller's transaction, those of a batch with their places in it. Returns those that ended at once with the
/// result of their source.
pub(crate) async fn insert_jobs(
    connection: &mut DbConnection,
    batch: Option<Uuid>,
    jobs: &[(Option<u32>, &NewJob)],
) -> Result<Vec<Uuid>, StoreError> {
    let mut ended = Vec::new();
    let batch = batch.map(|id| id.to_string());
    for some in jobs.chunks(ROWS_PER_STATEMENT) {
        let labels = some
            .iter()
            .map(|(_, job)| to_json(&job.labels))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rows = QueryBuilder::new(
            "INSERT INTO jobs (id, state, name, labels, method, created_at, updated_at, batch_id, batch_index, cost_us, slice_us, outputs, \
             cache_key, tenant, bypass_cache, rank, deadline, traceparent, case_bytes, kind) ",
        );
        rows.push_values(
            some.iter().zip(labels),
            |mut row, ((index, job), labels)| {
                row.push_bind(job.id.to_string())
                    .push("'queued'")
                    .push_bind(&job.name)
                    .push_bind(labels)
                    .push_bind(&job.method)
                    .push_bind(job.created_at)
                    .push_bind(job.created_at)
                    .push_bind(&batch)
                    .push_bind(index.map(i64::from))
                    .push_bind(i64::from(job.cost_us))
                    .push_bind(i64::from(job.slice_us))
                    .push_bind(&job.outputs)
                    .push_bind(job.cache_key.as_ref().map(CacheKey::as_slice))
                    .push_bind(&*job.tenant)
                    .push_bind(i64::from(job.options.bypass_cache))
                    .push_bind(job.options.priority.rank())
                    .push_bind(job.deadline())
                    .push_bind(job.traceparent.as_deref())
                    .push_bind(count(job.body.len()))
                    .push_bind(job.kind.name());
            },
        );
        rows.build().execute(&mut *connection).await?;
        let mut cases = QueryBuilder::new("INSERT INTO cases (job_id, row, body) ");
        cases.push_values(some, |mut row, (_, job)| {
            row.push_bind(job.id.to_string())
                .push_bind(i64::from(job.row))
                .push_bind(job.body.as_ref());
        });
        cases.build().execute(&mut *connection).await?;
        let labels: Vec<_> = some
            .iter()
            .flat_map(|(_, job)| job.labels.iter().map(move |label| (job, label)))
            .collect();
        for some in labels.chunks(ROWS_PER_STATEMENT) {
            let mut rows =
                QueryBuilder::new("INSERT INTO job_labels (of_tenant, key, value, job_id, state) ");
            rows.push_values(some, |mut row, (job, (key, value))| {
                row.push_bind(&*job.tenant)
                    .push_bind(*key)
                    .push_bind(*value)
                    .push_bind(job.id.to_string())
                    .push("'queued'");
            });
            rows.build().execute(&mut *connection).await?;
        }
        let jobs = some.iter().map(|(_, job)| *job);
        ended.extend(end_with_sources(&mut *connection, jobs).await?);
    }
    Ok(ended)
}
