//! Ends of claimed jobs in the embedded job table: one transaction, and so one write to the disk, for all of them.

use std::collections::HashSet;

use sqlx::{QueryBuilder, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::State;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::blobs::{insert_blobs, release_blobs};
use crate::jobs::store::sqlite::claims::fence;
use crate::jobs::store::sqlite::rows::{read_id, to_json};
use crate::jobs::store::{Claim, Ending, Placed};

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

/// The end of a job in the form the database takes.
pub(super) struct EndRow<'a> {
    pub(super) state: State,
    pub(super) remarks: String,
    pub(super) failure: Option<String>,
    pub(super) field_patches: u32,
    pub(super) result: Option<&'a Placed>,
}

impl EndRow<'_> {
    pub(super) fn of(ending: &Ending) -> Result<EndRow<'_>, JobsError> {
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
