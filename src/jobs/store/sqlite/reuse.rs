//! Results that are used again: finding the job that has one, and ending another job with it.
//!
//! A result is lent: the other job refers to the same blob, which is kept for as long as any job refers to it.

use std::collections::{HashMap, HashSet};

use sqlx::{QueryBuilder, Row, Sqlite, SqliteConnection};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::claims::fence;
use crate::jobs::store::sqlite::rows::{read_id, read_reuse_key};
use crate::jobs::store::{Claim, NewJob, ReuseKey};

/// One seek in the index, however many jobs have the same key.
const SOURCE: &str =
    "(SELECT id FROM jobs WHERE reuse_key = asked.reuse_key AND state = 'succeeded' LIMIT 1)";

impl SqliteStore {
    /// For each of these keys that a succeeded job carries, one such job.
    ///
    /// # Errors
    /// The database failed.
    pub async fn sources(&self, keys: &[ReuseKey]) -> Result<HashMap<ReuseKey, Uuid>, JobsError> {
        if keys.is_empty() {
            return Ok(HashMap::new());
        }
        let mut query = QueryBuilder::<Sqlite>::new("WITH asked (reuse_key) AS (");
        query.push_values(keys, |mut row, key| {
            row.push_bind(key.as_slice());
        });
        query.push(") SELECT reuse_key, ").push(SOURCE);
        query.push(" AS id FROM asked");
        let rows = query.build().fetch_all(&self.readers).await?;
        let mut sources = HashMap::new();
        for row in &rows {
            if row.try_get::<Option<&str>, _>("id")?.is_some()
                && let Some(key) = read_reuse_key(row)?
            {
                sources.insert(key, read_id(row)?);
            }
        }
        Ok(sources)
    }

    /// Ends claimed jobs with the results of their sources, as long as their leases are held. Returns those that ended; the
    /// source of another is gone, or its lease is lost.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn finish_with_sources(
        &self,
        pairs: &[(Claim, Uuid)],
        now: i64,
    ) -> Result<HashSet<Uuid>, JobsError> {
        let pairs: Vec<_> = pairs
            .iter()
            .map(|(claim, source)| Pair {
                job: claim.id,
                source: *source,
                at: now,
                lease_number: Some(fence(claim)),
            })
            .collect();
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let ended = end_pairs(&mut transaction, &pairs).await?;
        transaction.commit().await?;
        Ok(ended.into_iter().collect())
    }
}

/// Ends those of the jobs just queued that have a source, with its result. A job whose source is gone meanwhile stays
/// queued. Returns the jobs that ended.
pub(super) async fn end_with_sources(
    connection: &mut SqliteConnection,
    jobs: impl Iterator<Item = &NewJob>,
) -> Result<Vec<Uuid>, JobsError> {
    let pairs: Vec<_> = jobs
        .filter_map(|job| {
            let (source, at) = job.source?;
            Some(Pair {
                job: job.id,
                source,
                at,
                lease_number: None,
            })
        })
        .collect();
    end_pairs(connection, &pairs).await
}

/// A job and the one whose result it gets.
struct Pair {
    job: Uuid,
    source: Uuid,
    at: i64,
    /// Of a claimed job.
    lease_number: Option<i64>,
}

/// Ends jobs that are queued, or running under the given lease; returns them.
async fn end_pairs(
    connection: &mut SqliteConnection,
    pairs: &[Pair],
) -> Result<Vec<Uuid>, JobsError> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let mut update = with_pairs(pairs);
    update.push(
        " UPDATE jobs SET state = 'succeeded', started_at = pairs.at, ended_at = pairs.at, progress = 1.0, cached = 1, \
         remarks = source.remarks, blob_id = source.blob_id, field_patches = source.field_patches, \
         reuse_key = NULL, lease_until = NULL, worker = NULL, version = jobs.version + 1, \
         attempt = jobs.attempt - (pairs.lease_number IS NOT NULL) \
         FROM pairs JOIN jobs AS source ON source.id = pairs.source AND source.state = 'succeeded' \
         WHERE jobs.id = pairs.job AND (jobs.state = 'queued' AND pairs.lease_number IS NULL \
         OR jobs.state = 'running' AND jobs.lease_number = pairs.lease_number) RETURNING id",
    );
    let rows = update.build().fetch_all(&mut *connection).await?;
    rows.iter().map(read_id).collect()
}

fn with_pairs<'a>(pairs: impl IntoIterator<Item = &'a Pair>) -> QueryBuilder<Sqlite> {
    let mut query = QueryBuilder::new("WITH pairs (job, at, source, lease_number) AS (");
    query.push_values(pairs, |mut row, pair| {
        row.push_bind(pair.job.to_string())
            .push_bind(pair.at)
            .push_bind(pair.source.to_string())
            .push_bind(pair.lease_number);
    });
    query.push(")");
    query
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn a_source_is_found_by_one_seek() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        let statement =
            format!("WITH asked (reuse_key) AS (VALUES (x'00')) SELECT {SOURCE} FROM asked");
        let steps = plan(&store, &statement).await;
        assert!(
            steps
                .iter()
                .any(|step| step.contains("jobs_by_reuse_key (reuse_key=?)")),
            "{steps:?}"
        );
    }
}
