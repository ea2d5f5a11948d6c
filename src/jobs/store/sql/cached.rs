//! Cached results: a job ends with the result of another. It then refers to the same blob, which is kept for as long as any
//! job refers to it.

use super::blob_refs::drop_slices_of_ended;
use super::engine::{self, DbConnection, QueryBuilder};
use super::rows::read_id;
use uuid::Uuid;

use crate::jobs::store::submission::NewJob;
use crate::jobs::store_error::StoreError;

/// One seek in the index, however many jobs have the same key.
pub(crate) const SOURCE: &str =
    "(SELECT id FROM jobs WHERE cache_key = asked.cache_key AND state = 'succeeded' LIMIT 1)";

/// Ends those of the jobs just queued that have a source, with its result. A job whose source is gone meanwhile stays
/// queued. Returns the jobs that ended.
pub(crate) async fn end_with_sources(
    connection: &mut DbConnection,
    jobs: impl Iterator<Item = &NewJob>,
) -> Result<Vec<Uuid>, StoreError> {
    let pairs: Vec<_> = jobs
        .filter_map(|job| {
            let (source, at) = job.source?;
            Some(Pair {
                job: job.id,
                source,
                at,
                lease_token: None,
            })
        })
        .collect();
    end_pairs(connection, &pairs).await
}

/// A job and the one whose result it gets.
pub(crate) struct Pair {
    pub(crate) job: Uuid,
    pub(crate) source: Uuid,
    pub(crate) at: i64,
    /// Of a claimed job.
    pub(crate) lease_token: Option<i64>,
}

/// Ends jobs that are queued, or running under the given lease; returns them.
pub(crate) async fn end_pairs(
    connection: &mut DbConnection,
    pairs: &[Pair],
) -> Result<Vec<Uuid>, StoreError> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let sources: Vec<Uuid> = pairs.iter().map(|pair| pair.source).collect();
    engine::lock_jobs_for_share(connection, &sources).await?;
    let mut update = with_pairs(pairs);
    update.push(
        " UPDATE jobs SET state = 'succeeded', started_at = pairs.at, ended_at = pairs.at, updated_at = pairs.at, progress = 1.0, cached = 1, \
         remarks = source.remarks, blob_id = source.blob_id, field_patches = source.field_patches, \
         cache_key = NULL, lease_until = NULL, worker = NULL, version = jobs.version + 1, \
         attempt = CASE WHEN pairs.lease_token IS NULL THEN jobs.attempt ELSE jobs.attempt - 1 END \
         FROM pairs JOIN jobs AS source ON source.id = pairs.source AND source.state = 'succeeded' \
         WHERE jobs.id = pairs.job AND (jobs.state = 'queued' AND pairs.lease_token IS NULL \
         OR jobs.state = 'running' AND jobs.lease_token = pairs.lease_token) RETURNING jobs.id AS id, jobs.state AS state, jobs.slices AS slices",
    );
    let rows = update.build().fetch_all(&mut *connection).await?;
    drop_slices_of_ended(connection, &rows).await?;
    rows.iter().map(read_id).collect()
}

fn with_pairs<'a>(pairs: impl IntoIterator<Item = &'a Pair>) -> QueryBuilder {
    let mut query = QueryBuilder::new("WITH pairs (job, at, source, lease_token) AS (");
    query.push_values(pairs, |mut row, pair| {
        row.push_bind(pair.job.to_string())
            .push_bind(pair.at)
            .push_bind(pair.source.to_string())
            .push_bind(pair.lease_token);
    });
    query.push(")");
    query
}
