//! Slices of a sweep between two turns of the solver: stored when they are solved, read when the sweep is whole.

use uuid::Uuid;

use crate::jobs::attempts::attempt::Attempt;
use crate::jobs::attempts::outcome::Work;
use crate::jobs::attempts::slices::SlicedWork;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::error::JobsError;
use crate::jobs::storage_fault::StoragePlace;
use crate::jobs::store::ending::{NewSlice, SliceRecord, StoredResult};
use crate::jobs::submit::microseconds;
use crate::jobs::worker::pool::Worker;

/// What became of a slice that was to be stored.
pub(crate) enum SliceOutcome {
    /// It is stored.
    Stored,
    /// The lease is gone.
    Lost,
}

impl Worker {
    /// Stores a solved slice of a member, which goes on from there.
    pub(crate) async fn keep_slice(
        &self,
        attempt: &mut Attempt,
        place: usize,
        mut sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
    ) -> Result<SliceOutcome, JobsError> {
        let shared = &self.shared;
        let member = &mut attempt.members[place];
        if let Some((note, part)) = part {
            let claim = &member.claim;
            let (number, done) = (note.number, sliced.done_after_next());
            let result = match part.bytes() <= shared.options.small_result_max_bytes {
                true => StoredResult::Inline(part),
                false => {
                    let bytes = part.bytes() as u64;
                    let put = || shared.blobs.put_slice(claim, number, part.clone());
                    StoredResult::Blob(
                        shared
                            .write_with_retries(StoragePlace::Results, put)
                            .await?,
                        bytes,
                    )
                }
            };
            let slice = NewSlice {
                rest_us: u64::from(microseconds(sliced.seconds_left(done))),
                note,
                result,
                done,
            };
            let added = shared
                .write_with_retries(StoragePlace::Table, || {
                    shared.store.add_slice(claim, &slice)
                })
                .await?;
            if !added {
                if let StoredResult::Blob(key, _) = &slice.result {
                    self.abandon_blob(key).await;
                }
                return Ok(SliceOutcome::Lost);
            }
            tracing::debug!(job = %claim.id, number, done, "slice stored");
            sliced.advance(slice.note.spent);
            member.claim.slices = number + 1;
        }
        member.sliced = Some(sliced);
        Ok(SliceOutcome::Stored)
    }

    /// What is to be done next for a sweep.
    pub(crate) async fn next_of(
        &self,
        id: Uuid,
        mut sliced: Box<SlicedWork>,
    ) -> Result<Work, JobsError> {
        if !sliced.waits_for_parts() {
            return Ok(Work::Next(sliced));
        }
        match self.parts(id).await {
            Ok(parts) => Ok(Work::Join(sliced, parts)),
            Err(error) if error.storage_fault().is_some() => Err(error),
            Err(error) => {
                tracing::error!(job = %id, %error, "slices cannot be read; the sweep is solved again");
                sliced.begin_again();
                Ok(Work::Next(sliced))
            }
        }
    }

    /// The stored parts of the answer of a sweep.
    async fn parts(&self, id: Uuid) -> Result<Vec<EncodedResult>, JobsError> {
        let shared = &self.shared;
        let placed = shared.store.slice_results(id).await?;
        let mut parts = Vec::with_capacity(placed.len());
        for part in placed {
            parts.push(match part {
                StoredResult::Inline(part) => part,
                StoredResult::Blob(key, _) => shared.blobs.whole(&key).await?,
            });
        }
        Ok(parts)
    }
}
