//! Ends of jobs: with their own result, or with the result of another job, to whose blob they then refer.
use std::collections::{HashMap, HashSet};

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;
use uuid::Uuid;

use super::blobs::{drop_slices_of_ended, leave_to_collector, release_blobs};
use super::engine::{self, DbConnection, DbRow, QueryBuilder, SqlStore};
use super::rows::{fence, read_cache_key, read_id, read_move, read_optional_id, to_json};
use crate::model::State;
use crate::store::{CacheKey, Claim, Ending, Ends, NewJob, Result, StoredResult};

/// Finds the job of a cache key by one index lookup, however many jobs have the same key.
pub(crate) const SOURCE: &str =
    "(SELECT id FROM jobs WHERE cache_key = asked.cache_key AND state = 'succeeded' LIMIT 1)";

/// Ends the newly inserted jobs that have a source, with its result. A job whose source was removed in the
/// meantime stays queued. Returns the jobs that ended.
pub(crate) async fn end_with_sources(
    connection: &mut DbConnection,
    jobs: impl Iterator<Item = &NewJob>,
) -> Result<Vec<Uuid>> {
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

/// A job, and the job whose result it gets.
pub(crate) struct Pair {
    pub(crate) job: Uuid,
    pub(crate) source: Uuid,
    pub(crate) at: i64,
    /// The fencing token, if the job was claimed.
    pub(crate) lease_token: Option<i64>,
}

/// Ends jobs that are queued, or running with the given fencing token; returns them.
pub(crate) async fn end_pairs(connection: &mut DbConnection, pairs: &[Pair]) -> Result<Vec<Uuid>> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let sources: Vec<Uuid> = pairs.iter().map(|pair| pair.source).collect();
    engine::lock_jobs_for_share(connection, &sources).await?;
    let mut update = QueryBuilder::new("WITH pairs (job, at, source, lease_token) AS (");
    update.push_values(pairs, |mut row, pair| {
        values!(row; pair.job.to_string(), pair.at, pair.source.to_string(), pair.lease_token);
    });
    update.push(
        ") UPDATE jobs SET state = 'succeeded', started_at = pairs.at, ended_at = pairs.at, updated_at = pairs.at, progress = 1.0, cached = 1, \
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

impl SqlStore {
    /// Ends jobs with the outcomes of their solves if their leases are held. Returns the ids of the blobs, and the rows of
    /// the jobs that ended.
    async fn end_solved(
        &self,
        connection: &mut DbConnection,
        rows: &[(&Claim, EndRow<'_>)],
        now: i64,
    ) -> Result<(Vec<i64>, Vec<DbRow>)> {
        if rows.is_empty() {
            return Ok((Vec::new(), Vec::new()));
        }
        let results = rows.iter();
        let results: Vec<_> = results
            .filter_map(|(claim, end)| Some((*claim, end.result?)))
            .collect();
        let made = self.insert_blobs(connection, &results).await?;
        let mut blobs = made.iter();
        let mut update = QueryBuilder::new(
            "WITH done (id, lease_token, state, remarks, failure, blob, patches) AS (",
        );
        update.push_values(rows, |mut row, (claim, end)| {
            values!(row;
                claim.id.to_string(), fence(claim), end.state.name(), &end.remarks, &end.failure,
                end.result.and_then(|_| blobs.next().copied()), i64::from(end.field_patches)
            );
        });
        update.push(") UPDATE jobs SET state = done.state, ended_at = ");
        update.push_bind(now);
        update.push(", updated_at = ").push_bind(now);
        // Jobs are found by their ids: the index of running jobs contains dead rows until VACUUM.
        update.push(concat!(
            ", remarks = done.remarks, failure = done.failure, blob_id = done.blob, \
             field_patches = done.patches, \
             progress = CASE WHEN done.state = 'succeeded' THEN 1.0 ELSE progress END, \
             lease_until = NULL, worker = NULL, version = version + 1 \
             FROM done WHERE jobs.id = done.id AND jobs.lease_token = done.lease_token \
             AND ",
            unordered!("jobs.state"),
            " = 'running' RETURNING jobs.id AS id, jobs.state AS state, slices",
        ));
        let ended = update.build().fetch_all(connection).await?;
        Ok((made, ended))
    }
}

#[repeat_conflicts]
#[async_trait]
impl Ends for SqlStore {
    async fn finish(&self, ends: &[(Claim, Ending)], now: i64) -> Result<HashSet<Uuid>> {
        if ends.is_empty() {
            return Ok(HashSet::new());
        }
        let pairs: Vec<Pair> = ends
            .iter()
            .filter_map(|(claim, ending)| match ending {
                Ending::Cached { source } => Some(Pair {
                    job: claim.id,
                    source: *source,
                    at: now,
                    lease_token: Some(fence(claim)),
                }),
                _ => None,
            })
            .collect();
        let rows = ends
            .iter()
            .filter(|(_, ending)| !matches!(ending, Ending::Cached { .. }))
            .map(|(claim, ending)| Ok((claim, EndRow::of(ending)?)))
            .collect::<Result<Vec<_>>>()?;
        let mut transaction = engine::begin(&self.writer).await?;
        let (made, rows_ended) = self.end_solved(&mut transaction, &rows, now).await?;
        drop_slices_of_ended(&mut transaction, &rows_ended).await?;
        let ids = rows_ended
            .iter()
            .map(|row| Ok(read_move(row, State::Running)?.0));
        let mut ended = ids.collect::<Result<HashSet<Uuid>>>()?;
        if ended.len() < rows.len() {
            // Results of jobs whose lease was lost have no owner.
            release_blobs(&mut transaction, made).await?;
            let lost = rows.iter().filter(|(claim, _)| !ended.contains(&claim.id));
            let lost = lost.filter_map(|(_, end)| match end.result {
                Some(StoredResult::Blob(key, _)) => Some(key.clone()),
                _ => None,
            });
            leave_to_collector(&mut transaction, &lost.collect::<Vec<_>>()).await?;
        }
        ended.extend(end_pairs(&mut transaction, &pairs).await?);
        transaction.commit().await?;
        Ok(ended)
    }

    async fn cached(&self, keys: &[CacheKey]) -> Result<HashMap<CacheKey, Uuid>> {
        if keys.is_empty() {
            return Ok(HashMap::new());
        }
        let mut query = QueryBuilder::new("WITH asked (cache_key) AS (");
        query.push_values(keys, |mut row, key| {
            row.push_bind(key.as_slice());
        });
        query.push(") SELECT cache_key, ").push(SOURCE);
        query.push(" AS id FROM asked");
        let mut connection = self.readers.acquire().await?;
        let rows = query.build().fetch_all(&mut *connection).await?;
        let mut sources = HashMap::new();
        for row in &rows {
            let id = read_optional_id(row, "id")?;
            sources.extend(read_cache_key(row)?.zip(id));
        }
        Ok(sources)
    }
}

/// The end of a job as column values.
pub(crate) struct EndRow<'a> {
    pub(crate) state: State,
    pub(crate) remarks: String,
    pub(crate) failure: Option<String>,
    pub(crate) field_patches: u32,
    pub(crate) result: Option<&'a StoredResult>,
}

impl EndRow<'_> {
    pub(crate) fn of(ending: &Ending) -> Result<EndRow<'_>> {
        let mut row = EndRow {
            state: State::Cancelled,
            remarks: "[]".to_owned(),
            failure: None,
            field_patches: 0,
            result: None,
        };
        match ending {
            Ending::Succeeded {
                remarks,
                result,
                field_patches,
            } => {
                row.state = State::Succeeded;
                row.remarks = to_json(remarks)?;
                row.field_patches = *field_patches;
                row.result = Some(result);
            }
            Ending::Failed { failure, remarks } => {
                row.state = State::Failed;
                row.remarks = to_json(remarks)?;
                row.failure = Some(to_json(failure)?);
            }
            // `Cached` is handled by `end_pairs`.
            Ending::Cancelled | Ending::Cached { .. } => {}
        }
        Ok(row)
    }
}
