//! Ends of claimed jobs in the embedded job table: one transaction, and so one write to the disk, for all of them.

use crate::jobs::store::sqlite::cached::Pair;
use crate::jobs::store::sqlite::cached::SOURCE;
use crate::jobs::store::sqlite::cached::end_pairs;
use crate::jobs::store::sqlite::rows::read_cache_key;
use crate::jobs::store::types::CacheKey;
use sqlx::Row;
use std::collections::HashMap;
use std::collections::HashSet;

use sqlx::{QueryBuilder, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::model::State;
use crate::jobs::store::sqlite::blobs::{insert_blobs, release_blobs};
use crate::jobs::store::sqlite::database::SqliteStore;
use crate::jobs::store::sqlite::rows::fence;
use crate::jobs::store::sqlite::rows::{read_id, to_json};
use crate::jobs::store::types::{Claim, Ending, StoredResult};

impl SqliteStore {
    /// Ends jobs, all in one transaction. Returns those that ended; the others' leases were lost and nothing of them
    /// changed.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn finish(
        &self,
        ends: &[(Claim, Ending)],
        now: i64,
    ) -> Result<HashSet<Uuid>, JobsError> {
        if ends.is_empty() {
            return Ok(HashSet::new());
        }
        let rows = ends
            .iter()
            .map(|(claim, ending)| Ok((claim, EndRow::of(ending)?)))
            .collect::<Result<Vec<_>, JobsError>>()?;
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let results: Vec<_> = rows.iter().filter_map(|(_, end)| end.result).collect();
        let mut blobs = insert_blobs(&mut transaction, &results).await?.into_iter();
        let mut update = QueryBuilder::<Sqlite>::new(
            "WITH done (id, lease_number, state, remarks, failure, blob, patches) AS (",
        );
        let mut inserted = Vec::with_capacity(results.len());
        update.push_values(&rows, |mut row, (claim, end)| {
            let blob = end.result.and_then(|_| blobs.next());
            inserted.extend(blob);
            row.push_bind(claim.id.to_string())
                .push_bind(fence(claim))
                .push_bind(end.state.name())
                .push_bind(&end.remarks)
                .push_bind(&end.failure)
                .push_bind(blob)
                .push_bind(end.field_patches);
        });
        update.push(") UPDATE jobs SET state = done.state, ended_at = ");
        update.push_bind(now);
        update.push(
            ", remarks = done.remarks, failure = done.failure, blob_id = done.blob, \
             field_patches = done.patches, \
             progress = CASE WHEN done.state = 'succeeded' THEN 1.0 ELSE progress END, \
             lease_until = NULL, worker = NULL, solving = 0, version = version + 1 \
             FROM done WHERE jobs.id = done.id AND jobs.lease_number = done.lease_number \
             AND jobs.state = 'running' RETURNING id",
        );
        let ended = update.build().fetch_all(&mut *transaction).await?;
        let ended = ended
            .iter()
            .map(read_id)
            .collect::<Result<HashSet<_>, _>>()?;
        if ended.len() < rows.len() {
            // The results of those whose lease was lost have no owner.
            release_blobs(&mut transaction, inserted).await?;
        }
        transaction.commit().await?;
        Ok(ended)
    }
}

impl SqliteStore {
    /// For each of these keys that a succeeded job carries, one such job.
    ///
    /// # Errors
    /// The database failed.
    pub async fn sources(&self, keys: &[CacheKey]) -> Result<HashMap<CacheKey, Uuid>, JobsError> {
        if keys.is_empty() {
            return Ok(HashMap::new());
        }
        let mut query = QueryBuilder::<Sqlite>::new("WITH asked (cache_key) AS (");
        query.push_values(keys, |mut row, key| {
            row.push_bind(key.as_slice());
        });
        query.push(") SELECT cache_key, ").push(SOURCE);
        query.push(" AS id FROM asked");
        let rows = query.build().fetch_all(&self.readers).await?;
        let mut sources = HashMap::new();
        for row in &rows {
            if row.try_get::<Option<&str>, _>("id")?.is_some()
                && let Some(key) = read_cache_key(row)?
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

/// The end of a job in the form the database takes.
pub(crate) struct EndRow<'a> {
    pub(crate) state: State,
    pub(crate) remarks: String,
    pub(crate) failure: Option<String>,
    pub(crate) field_patches: u32,
    pub(crate) result: Option<&'a StoredResult>,
}

impl EndRow<'_> {
    pub(crate) fn of(ending: &Ending) -> Result<EndRow<'_>, JobsError> {
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
            Ending::Failed(failure) => {
                row.state = State::Failed;
                row.failure = Some(to_json(failure)?);
            }
            Ending::Cancelled => {}
        }
        Ok(row)
    }
}
