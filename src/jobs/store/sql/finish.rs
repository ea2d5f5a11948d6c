//! Ends of jobs: with their own result, or with the result of another job, to whose blob they then refer.
use std::collections::{HashMap, HashSet};

use railhead_macros::store_trait;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, leave_to_collector, release_blobs};
use super::engine::{self, DbConnection, SqlStore, built, query};
use super::rows::{fence, read_cache_key, read_id, read_move, read_optional_id, to_json, values};
use crate::model::State;
use crate::store::{CacheKey, Claim, Ending, NewJob, Result, StoredResult};

/// Finds the job of a cache key by one index lookup, however many jobs have the same key.
pub(crate) const SOURCE: &str =
    "(SELECT id FROM jobs WHERE cache_key = asked.cache_key AND state = 'succeeded' LIMIT 1)";

/// Succeeded jobs by the cache key of their results.
pub(crate) type Sources = HashMap<CacheKey, Uuid>;

/// Finds a succeeded job for each new job with the same cache key, if there is one.
pub(crate) async fn find_sources(
    connection: &mut DbConnection,
    jobs: impl Iterator<Item = &NewJob>,
) -> Result<Sources> {
    let keys: Vec<CacheKey> = jobs.filter_map(NewJob::lookup_key).collect();
    if keys.is_empty() {
        return Ok(Sources::new());
    }
    let mut query = built(format!(
        "WITH asked (cache_key) AS ({}) SELECT cache_key, {SOURCE} AS id FROM asked",
        values(keys.len(), 1)
    ));
    for key in &keys {
        bind!(query; key.as_slice());
    }
    let mut sources = Sources::new();
    for row in &query.fetch_all(connection).await? {
        let id = read_optional_id(row, "id")?;
        sources.extend(read_cache_key(row)?.zip(id));
    }
    Ok(sources)
}

/// Ends the newly inserted jobs that have a source, with its result. A job whose source was removed in the
/// meantime stays queued. Returns the jobs that ended.
pub(crate) async fn end_with_sources(
    connection: &mut DbConnection,
    jobs: impl Iterator<Item = &NewJob>,
    sources: &Sources,
) -> Result<Vec<Uuid>> {
    let pairs = jobs.filter_map(|job| {
        let source = sources.get(&job.lookup_key()?)?;
        Some((job.id, *source, job.created_at, None))
    });
    end_pairs(connection, &pairs.collect::<Vec<_>>()).await
}

/// A job, the job whose result it gets, the time of its end, and the fencing token if the job was claimed.
type Pair = (Uuid, Uuid, i64, Option<i64>);

/// Jobs and sources are found by their ids: the index of running jobs contains dead rows until VACUUM.
pub(crate) const END_PAIRS: &str = concat!(
    "WITH pairs AS (SELECT value ->> 0 AS job, value ->> 1 AS source, CAST(value ->> 2 AS bigint) AS at, \
     CAST(value ->> 3 AS bigint) AS lease_token FROM ",
    json_rows!("$1"),
    ") UPDATE jobs SET state = 'succeeded', started_at = pairs.at, ended_at = pairs.at, updated_at = pairs.at, progress = 1.0, cached = 1, \
     remarks = source.remarks, blob_id = source.blob_id, field_patches = source.field_patches, \
     lease_until = NULL, worker = NULL, version = jobs.version + 1, \
     attempt = CASE WHEN pairs.lease_token IS NULL THEN jobs.attempt ELSE jobs.attempt - 1 END \
     FROM pairs JOIN jobs AS source ON source.id = pairs.source AND source.state || '' = 'succeeded' \
     WHERE jobs.id = pairs.job AND (jobs.state || '' = 'queued' AND pairs.lease_token IS NULL \
     OR jobs.state || '' = 'running' AND jobs.lease_token = pairs.lease_token) \
     RETURNING jobs.id AS id, jobs.state AS state, jobs.slices AS slices"
);

/// Ends jobs that are queued, or running with the given fencing token; returns them.
async fn end_pairs(connection: &mut DbConnection, pairs: &[Pair]) -> Result<Vec<Uuid>> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let sources: Vec<Uuid> = pairs.iter().map(|(_, source, ..)| *source).collect();
    engine::lock_jobs_for_share(connection, &sources).await?;
    let rows = sql!(fetch_all, &mut *connection, END_PAIRS; to_json(pairs)?)?;
    drop_slices_of_ended(connection, &rows).await?;
    rows.iter().map(read_id).collect()
}

/// Ends jobs with the outcomes of their solves if their leases are held.
pub(crate) const FINISH: &str = concat!(
    "WITH done AS (SELECT value ->> 0 AS id, CAST(value ->> 1 AS bigint) AS lease_token, value ->> 2 AS state, \
     value ->> 3 AS remarks, value ->> 4 AS failure, CAST(value ->> 5 AS bigint) AS blob, \
     CAST(value ->> 6 AS bigint) AS patches FROM ",
    json_rows!("$1"),
    ") UPDATE jobs SET state = done.state, ended_at = $2, updated_at = $2, \
     remarks = done.remarks, failure = done.failure, blob_id = done.blob, field_patches = done.patches, \
     progress = CASE WHEN done.state = 'succeeded' THEN 1.0 ELSE progress END, \
     lease_until = NULL, worker = NULL, version = version + 1 \
     FROM done WHERE jobs.id = done.id AND jobs.lease_token = done.lease_token \
     AND jobs.state || '' = 'running' RETURNING jobs.id AS id, jobs.state AS state, slices"
);

/// Ends of claimed jobs.
#[store_trait]
impl Ends for SqlStore {
    /// Ends claimed jobs in one transaction; returns those that ended. Of the others the lease was lost, or the source of
    /// their cached result was removed.
    async fn finish(&self, ends: &[(Claim, Ending)], now: i64) -> Result<HashSet<Uuid>> {
        if ends.is_empty() {
            return Ok(HashSet::new());
        }
        let results = ends.iter().filter_map(|(claim, ending)| match ending {
            Ending::Succeeded { result, .. } => Some((claim, result)),
            _ => None,
        });
        let results: Vec<_> = results.collect();
        let mut transaction = engine::begin(&self.writer).await?;
        let made = self.insert_blobs(&mut transaction, &results).await?;
        let mut blobs = made.iter();
        let (mut done, mut pairs) = (Vec::new(), Vec::new());
        for (claim, ending) in ends {
            let (remarks, failure, blob, patches) = match ending {
                Ending::Succeeded {
                    remarks,
                    field_patches,
                    ..
                } => (to_json(remarks)?, None, blobs.next(), *field_patches),
                Ending::Failed { failure, remarks } => {
                    (to_json(remarks)?, Some(to_json(failure)?), None, 0)
                }
                Ending::Cancelled => ("[]".to_owned(), None, None, 0),
                Ending::Cached { source } => {
                    pairs.push((claim.id, *source, now, Some(fence(claim))));
                    continue;
                }
            };
            let state = ending.state().name();
            done.push((
                claim.id,
                fence(claim),
                state,
                remarks,
                failure,
                blob,
                patches,
            ));
        }
        let rows = sql!(fetch_all, &mut *transaction, FINISH; to_json(&done)?, now)?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        let ids = rows.iter().map(|row| Ok(read_move(row, State::Running)?.0));
        let mut ended = ids.collect::<Result<HashSet<Uuid>>>()?;
        if ended.len() < done.len() {
            // Results of jobs whose lease was lost have no owner.
            release_blobs(&mut transaction, made).await?;
            let lost = results
                .iter()
                .filter(|(claim, _)| !ended.contains(&claim.id));
            let lost = lost.filter_map(|(_, result)| match result {
                StoredResult::Blob(key, _) => Some(key.clone()),
                StoredResult::Inline(_) => None,
            });
            leave_to_collector(&mut transaction, &lost.collect::<Vec<_>>()).await?;
        }
        ended.extend(end_pairs(&mut transaction, &pairs).await?);
        transaction.commit().await?;
        Ok(ended)
    }
}
