//! Writes what became of claimed jobs: known answers, stored results, ends; the rest goes back to the queue.

use std::collections::{HashMap, HashSet};
use std::time::SystemTime;

use uuid::Uuid;

use crate::jobs::attempts::attempt::{Attempt, Phase};
use crate::jobs::attempts::attempt_control::StopReason;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::error::JobsError;
use crate::jobs::model::job::{Failure, FailureKind, State};
use crate::jobs::storage_fault::StoragePlace;
use crate::jobs::store::claim::{Claim, ReleaseReason};
use crate::jobs::store::ending::{Ending, StoredResult};
use crate::jobs::worker::disposition::{Disposition, disposition_of};
use crate::jobs::worker::pool::{StepReport, Worker};
use crate::jobs::worker::slice_storage::SliceOutcome;

impl Worker {
    /// Reads the cases of the claimed jobs, and ends those whose result has been there since they were queued. To be called once the attempt
    /// is listed: a cancellation is then either read here or finds the control of the attempt.
    pub(crate) async fn read_cases(
        &self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        let claims = attempt.claims(|phase| matches!(phase, Phase::Solving));
        let ids: Vec<_> = claims.iter().map(|claim| claim.id).collect();
        let mut cases = self.shared.store.claimed_cases(&ids).await?;
        let mut known = Vec::new();
        for member in &mut attempt.members {
            if let Some(case) = cases.remove(&member.claim.id) {
                let source = case.source.filter(|_| member.claim.cache_key.is_some());
                known.extend(source.map(|source| (member.claim.clone(), source)));
                member.case = Some(case);
            }
        }
        self.answer_with(attempt, known, step).await
    }

    /// Ends claimed jobs with the results of these others; where there is none, the job goes back to the queue.
    async fn answer_with(
        &self,
        attempt: &mut Attempt,
        pairs: Vec<(Claim, Uuid)>,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        if pairs.is_empty() {
            return Ok(());
        }
        let shared = &self.shared;
        let from = shared.options.tracer.is_some().then(SystemTime::now);
        let ends: Vec<_> = pairs
            .iter()
            .map(|(claim, source)| (claim.clone(), Ending::Cached { source: *source }))
            .collect();
        let ended = shared
            .write_with_retries(StoragePlace::Table, || {
                shared.store.finish(&ends, shared.now_ms())
            })
            .await?;
        let ids: Vec<_> = ended.iter().copied().collect();
        shared.metrics.cache_lookup(ids.len() as u64, 0);
        if let Some(from) = from {
            let claims = pairs.iter().map(|(claim, _)| claim);
            for claim in claims.filter(|claim| ended.contains(&claim.id)) {
                if let Some(traced) = shared.job_trace(claim) {
                    traced.waited_until(from);
                    traced.stored(from, State::Succeeded.name());
                }
            }
        }
        shared.ended_cached(&ids);
        attempt.done(&ids);
        step.ended
            .extend(ids.into_iter().map(|id| (id, State::Succeeded)));
        let back = pairs.into_iter().map(|(claim, _)| claim);
        let back: Vec<_> = back.filter(|claim| !ended.contains(&claim.id)).collect();
        self.release(attempt, &back, ReleaseReason::SolveItself, step)
            .await
    }

    /// Writes down what became of the members that are over.
    pub(crate) async fn record(
        &self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        let shared = &self.shared;
        let from = shared.options.tracer.is_some().then(SystemTime::now);
        let mut pending = PendingWrites::default();
        for place in 0..attempt.members.len() {
            let phase = &mut attempt.members[place].phase;
            if !matches!(phase, Phase::Solved(_)) {
                continue;
            }
            if let Phase::Solved(outcome) = std::mem::replace(phase, Phase::Done) {
                let reason = attempt.members[place].control.reason();
                self.apply(
                    attempt,
                    place,
                    disposition_of(outcome, reason),
                    &mut pending,
                )
                .await;
            }
        }
        attempt.done(&pending.lost);
        step.lost.append(&mut pending.lost);
        let PendingWrites {
            ends,
            mut back,
            long,
            ..
        } = pending;
        self.finish(attempt, ends, from, step).await?;
        back.extend(attempt.claims(|phase| matches!(phase, Phase::NotBegun)));
        self.release(attempt, &back, ReleaseReason::NotBegun, step)
            .await?;
        let slice_us = u64::try_from(attempt.spent.as_micros()).unwrap_or(u64::MAX);
        self.release(attempt, &long, ReleaseReason::Long { slice_us }, step)
            .await?;
        self.settle_duplicates(attempt, step).await
    }

    /// Stores the result or the slice that a verdict keeps, and notes what remains to be written for the member.
    async fn apply(
        &self,
        attempt: &mut Attempt,
        place: usize,
        verdict: Disposition,
        pending: &mut PendingWrites,
    ) {
        let claim = attempt.members[place].claim.clone();
        let stored = match verdict {
            Disposition::Discard => return pending.lost.push(claim.id),
            Disposition::Release => return pending.back.push(claim),
            Disposition::ReleaseAsLong => return pending.long.push(claim),
            Disposition::End(ending) => Ok(ending),
            Disposition::StoreSlice {
                sliced,
                part,
                stopped,
            } => match self.keep_slice(attempt, place, sliced, part).await {
                Ok(SliceOutcome::Lost) => return pending.lost.push(claim.id),
                Ok(SliceOutcome::Stored) => match stopped {
                    Some(StopReason::TooLong) => return pending.long.push(claim),
                    Some(_) => return pending.back.push(claim),
                    None if self.makes_room(attempt).await => return pending.back.push(claim),
                    None => return attempt.members[place].phase = Phase::Solving,
                },
                Err(error) => Err(error),
            },
            Disposition::Store {
                result,
                remarks,
                field_patches,
            } => self
                .store_result(&claim, result)
                .await
                .map(|result| Ending::Succeeded {
                    remarks,
                    result,
                    field_patches,
                }),
        };
        match stored {
            Ok(ending) => pending.ends.push((claim, ending)),
            // The service stops while the disk takes nothing.
            Err(error) if error.storage_fault().is_some() => pending.back.push(claim),
            Err(error) => pending.ends.push((claim, not_stored(&error))),
        }
    }

    async fn finish(
        &self,
        attempt: &mut Attempt,
        ends: Vec<(Claim, Ending)>,
        from: Option<SystemTime>,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        if ends.is_empty() {
            return Ok(());
        }
        let shared = &self.shared;
        // A database that fails for a while does not cost the results.
        let ended = shared
            .write_with_retries(StoragePlace::Table, || {
                shared.store.finish(&ends, shared.now_ms())
            })
            .await?;
        for (claim, ending) in &ends {
            if ended.contains(&claim.id) {
                if let (Some(from), Some(traced)) = (from, shared.job_trace(claim)) {
                    traced.stored(from, ending.state().name());
                }
                shared.metrics.ending(ending);
                shared.announce(claim.id);
                step.ended.push((claim.id, ending.state()));
            } else {
                step.lost.push(claim.id);
                if let Ending::Succeeded {
                    result: StoredResult::Blob(key, _),
                    ..
                } = ending
                {
                    self.abandon_blob(key).await;
                }
            }
        }
        let ids: Vec<_> = ends.iter().map(|(claim, _)| claim.id).collect();
        attempt.done(&ids);
        if ends.iter().any(|(claim, _)| claim.slices > 0) {
            shared.collect_blobs().await;
        }
        Ok(())
    }

    /// Leaves a result that no job refers to, to be removed.
    pub(crate) async fn abandon_blob(&self, key: &str) {
        if let Err(error) = self.shared.store.abandon_blob(key).await {
            tracing::warn!(key, %error, "a result without a job is left until the next start");
        }
    }

    /// Ends members that waited for an equal one with its answer; without an answer they go back to the queue.
    async fn settle_duplicates(
        &self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        let still: HashSet<Uuid> = attempt
            .claims(|phase| matches!(phase, Phase::Solving))
            .iter()
            .map(|claim| claim.id)
            .collect();
        let firsts: HashMap<Uuid, Uuid> = attempt
            .members
            .iter()
            .filter_map(|member| match member.phase {
                Phase::WaitingFor(first) if !still.contains(&first) => {
                    Some((member.claim.id, first))
                }
                _ => None,
            })
            .collect();
        let duplicates = attempt.claims(|phase| matches!(phase, Phase::WaitingFor(_)));
        let pairs = duplicates.into_iter().filter_map(|claim| {
            let first = *firsts.get(&claim.id)?;
            Some((claim, first))
        });
        self.answer_with(attempt, pairs.collect(), step).await
    }

    /// Stores a large result as a blob; a small one is handed back and goes into the database with the end of its job.
    async fn store_result(
        &self,
        claim: &Claim,
        result: EncodedResult,
    ) -> Result<StoredResult, JobsError> {
        let shared = &self.shared;
        // Other programs read the answers of rows where they lie.
        if !result.is_rows() && result.bytes() <= shared.options.small_result_max_bytes {
            return Ok(StoredResult::Inline(result));
        }
        let bytes = result.bytes() as u64;
        let key = shared
            .write_with_retries(StoragePlace::Results, || {
                shared.blobs.put(claim, result.clone())
            })
            .await?;
        Ok(StoredResult::Blob(key, bytes))
    }

    pub(crate) async fn release(
        &self,
        attempt: &mut Attempt,
        claims: &[Claim],
        why: ReleaseReason,
        step: &mut StepReport,
    ) -> Result<(), JobsError> {
        if claims.is_empty() {
            return Ok(());
        }
        let shared = &self.shared;
        // While the store is away the jobs stay claimed: a lease that ran out would count as an attempt.
        let released = shared
            .write_with_retries(StoragePlace::Table, || {
                shared.store.release(claims, why, shared.now_ms())
            })
            .await?;
        for (id, state) in &released {
            if state.ended() {
                shared.metrics.ended(*state, 1);
                shared.announce(*id);
                step.ended.push((*id, *state));
            } else {
                step.handed_back.push(*id);
            }
        }
        let kept: HashSet<_> = released.iter().map(|(id, _)| *id).collect();
        let lost = claims.iter().map(|claim| claim.id);
        step.lost.extend(lost.filter(|id| !kept.contains(id)));
        let ids: Vec<_> = claims.iter().map(|claim| claim.id).collect();
        attempt.done(&ids);
        shared.wake_workers();
        Ok(())
    }
}

/// What remains to be written for the members of an attempt, in few transactions for all of them.
#[derive(Default)]
struct PendingWrites {
    ends: Vec<(Claim, Ending)>,
    back: Vec<Claim>,
    long: Vec<Claim>,
    lost: Vec<Uuid>,
}

/// The end of a job whose result could not be stored.
fn not_stored(error: &JobsError) -> Ending {
    tracing::error!(%error, "result could not be stored");
    Ending::Failed(Failure::new(
        FailureKind::Internal,
        "the result could not be stored; the log of the service says why",
    ))
}
