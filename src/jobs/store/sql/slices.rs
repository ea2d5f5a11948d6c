//! Solved slices of jobs that are not solved whole.

use super::blob_refs::release_blobs;
use super::engine::{self, Row, SqlStore, query};
use super::rows::{count, fence, read_blob_ids, read_count, read_small};
use std::time::Duration;

use uuid::Uuid;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::store::Slices;
use crate::jobs::store::claim::Claim;
use crate::jobs::store::ending::{NewSlice, SliceRecord, StoredResult};
use crate::jobs::store_error::StoreError;

pub(crate) const NOTES: &str =
    "SELECT number, motions, digest, spent_us FROM job_slices WHERE job_id = $1 ORDER BY number";

pub(crate) const RESULTS: &str = "SELECT key, bytes, solution, fields FROM job_slices JOIN blobs ON blobs.id = blob_id \
     WHERE job_id = $1 ORDER BY number";

#[repeat_conflicts]
#[async_trait]
impl Slices for SqlStore {
    async fn add_slice(&self, claim: &Claim, slice: &NewSlice) -> Result<bool, StoreError> {
        let id = claim.id.to_string();
        let note = &slice.note;
        let spent_us = i64::try_from(note.spent.as_micros()).unwrap_or(i64::MAX);
        let mut transaction = engine::begin(&self.writer).await?;
        // Attempts are counted from the last slice that was stored: who gets on is not what processes die of.
        let added = query(
            "UPDATE jobs SET attempt = 1, version = version + 1, slices = $1, done = $2, progress = $2, cost_us = $3 \
             WHERE id = $4 AND lease_token = $5 AND state = 'running'",
        )
        .bind(i64::from(note.number) + 1)
        .bind(slice.done)
        .bind(count(slice.rest_us))
        .bind(&id)
        .bind(fence(claim))
        .execute(&mut *transaction)
        .await?;
        if added.rows_affected() == 0 {
            return Ok(false);
        }
        let there = query(
            "SELECT 1 FROM job_slices WHERE job_id = $1 AND number = $2 AND digest = $3 AND spent_us = $4",
        )
        .bind(&id)
        .bind(i64::from(note.number))
        .bind(&note.digest)
        .bind(spent_us)
        .fetch_optional(&mut *transaction)
        .await?;
        if there.is_none() {
            let replaced = query(
                "DELETE FROM job_slices WHERE job_id = $1 AND number >= $2 RETURNING blob_id",
            )
            .bind(&id)
            .bind(i64::from(note.number))
            .fetch_all(&mut *transaction)
            .await?;
            release_blobs(&mut transaction, read_blob_ids(&replaced)?).await?;
            let blobs = self
                .insert_blobs(&mut transaction, &[(claim, &slice.result)])
                .await?;
            query(
                "INSERT INTO job_slices (job_id, number, motions, digest, spent_us, blob_id) \
                 VALUES ($1, $2, $3, $4, $5, $6)",
            )
            .bind(&id)
            .bind(i64::from(note.number))
            .bind(i64::from(note.motions))
            .bind(&note.digest)
            .bind(spent_us)
            .bind(blobs.first())
            .execute(&mut *transaction)
            .await?;
        }
        transaction.commit().await?;
        Ok(true)
    }

    async fn slices(&self, id: Uuid) -> Result<Vec<SliceRecord>, StoreError> {
        let rows = query(NOTES)
            .bind(id.to_string())
            .fetch_all(&self.readers)
            .await?;
        rows.iter()
            .map(|row| {
                Ok(SliceRecord {
                    number: read_small(row, "number")?,
                    motions: read_small(row, "motions")?,
                    digest: row.try_get("digest")?,
                    spent: Duration::from_micros(read_count(row, "spent_us")?),
                })
            })
            .collect()
    }

    async fn slice_results(&self, id: Uuid) -> Result<Vec<StoredResult>, StoreError> {
        let rows = query(RESULTS)
            .bind(id.to_string())
            .fetch_all(&self.readers)
            .await?;
        rows.iter()
            .map(|row| {
                if let Some(key) = row.try_get::<Option<String>, _>("key")? {
                    return Ok(StoredResult::Blob(key, read_count(row, "bytes")?));
                }
                Ok(StoredResult::inline(
                    row.try_get("solution")?,
                    row.try_get("fields")?,
                ))
            })
            .collect()
    }
}
