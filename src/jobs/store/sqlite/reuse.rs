//! Results that are used again: finding the job that has one, and ending another job with it.
//!
//! A small result is copied. A large one stays in the folder of the job that computed it, which is kept for as long as
//! any job needs it.

use std::collections::HashMap;

use sqlx::{QueryBuilder, Row, Sqlite, SqliteConnection};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::read_id;
use crate::jobs::store::{NewJob, ReuseKey};

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
            if row.try_get::<Option<&str>, _>("id")?.is_some() {
                let key: Vec<u8> = row.try_get("reuse_key")?;
                let key = ReuseKey::try_from(key)
                    .map_err(|_| JobsError::Damaged("a reuse key has a wrong length".to_owned()))?;
                sources.insert(key, read_id(row)?);
            }
        }
        Ok(sources)
    }

    /// The folders of these jobs that another job's result lies in.
    ///
    /// # Errors
    /// The database failed.
    pub(super) async fn lenders(&self, ids: &[Uuid]) -> Result<Vec<Uuid>, JobsError> {
        let mut query = QueryBuilder::<Sqlite>::new(
            "SELECT DISTINCT result_owner AS id FROM jobs WHERE result_owner IN (",
        );
        let mut list = query.separated(", ");
        for id in ids {
            list.push_bind(id.to_string());
        }
        query.push(")");
        let rows = query.build().fetch_all(&self.readers).await?;
        rows.iter().map(read_id).collect()
    }
}

/// Ends those of the jobs just queued that have a source, with its result. A job whose source is gone meanwhile stays
/// queued. Returns the jobs that ended.
pub(super) async fn end_with_sources(
    connection: &mut SqliteConnection,
    jobs: impl Iterator<Item = &NewJob>,
) -> Result<Vec<Uuid>, JobsError> {
    let pairs: Vec<_> = jobs.filter_map(|job| Some((job.id, job.source?))).collect();
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let mut update = with_pairs(&pairs);
    update.push(
        " UPDATE jobs SET state = 'succeeded', started_at = pairs.at, ended_at = pairs.at, progress = 1.0, cached = 1, \
         warnings = source.warnings, result_key = source.result_key, field_patches = source.field_patches, \
         result_owner = CASE WHEN source.result_key IS NULL THEN NULL ELSE COALESCE(source.result_owner, source.id) END, \
         reuse_key = NULL, version = jobs.version + 1 \
         FROM pairs JOIN jobs AS source ON source.id = pairs.source AND source.state = 'succeeded' \
         WHERE jobs.id = pairs.job RETURNING id",
    );
    let ended = update.build().fetch_all(&mut *connection).await?;
    let mut copy = with_pairs(&pairs);
    copy.push(
        " INSERT INTO results (job_id, solution, fields) SELECT pairs.job, solution, fields \
         FROM pairs JOIN results ON results.job_id = pairs.source",
    );
    copy.build().execute(&mut *connection).await?;
    ended.iter().map(read_id).collect()
}

fn with_pairs(pairs: &[(Uuid, (Uuid, i64))]) -> QueryBuilder<Sqlite> {
    let mut query = QueryBuilder::new("WITH pairs (job, at, source) AS (");
    query.push_values(pairs, |mut row, (job, (source, at))| {
        row.push_bind(job.to_string())
            .push_bind(*at)
            .push_bind(source.to_string());
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
