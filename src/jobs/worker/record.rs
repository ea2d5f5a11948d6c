//! What follows for a job from the outcome of its solver and from the reason for which the solver was told to stop. This is the
//! one place that decides it.
use std::collections::{HashMap, HashSet};
use std::time::SystemTime;

use uuid::Uuid;

use crate::attempts::attempt::{Attempt, Phase, StopReason};
use crate::attempts::slices::{INTERNAL, Outcome, SlicedWork, Work};
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::model::{Failure, FailureKind, State, too_late};
use crate::storage_fault::StoragePlace;
use crate::store::{Claim, Ending, NewSlice, ReleaseReason, SliceRecord, StoredResult};
use crate::submit::microseconds;
use crate::worker::pool::{StepReport, Worker};
use railhead_contact::error::SolveError;
use railhead_contact::remark::entry::RemarkEntry;

/// What follows from the outcome of an attempt.
pub(crate) enum Disposition {
    /// Store a solved slice, if there is one; the case is not solved whole. With a reason to stop it is released then, without
    /// one the next slice is solved.
    StoreSlice {
        sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
        stopped: Option<StopReason>,
    },
    /// Store the answer, then end.
    Store {
        result: EncodedResult,
        remarks: Vec<RemarkEntry>,
        field_patches: u32,
    },
    /// End without an answer.
    End(Ending),
    /// Give the job back to the queue, its attempt uncounted.
    Release,
    /// The same, and note that a slice of it takes longer than was expected.
    ReleaseAsLong,
    /// The lease is lost: discard whatever there is.
    Discard,
}

/// What follows from an outcome and the reason for which the solver was stopped, if it was.
pub(crate) fn disposition_of(outcome: Outcome, reason: Option<StopReason>) -> Disposition {
    let failed = |failure, remarks| Disposition::End(Ending::Failed { failure, remarks });
    let internal = |reason: String| {
        tracing::error!(reason, "a job fails inside the service");
        Failure::new(FailureKind::Internal, INTERNAL)
    };
    let stopped = |remarks| match reason {
        Some(StopReason::Cancel) => Disposition::End(Ending::Cancelled),
        Some(StopReason::Shutdown) => Disposition::Release,
        Some(StopReason::TooLong) => Disposition::ReleaseAsLong,
        Some(StopReason::Lost) => Disposition::Discard,
        Some(StopReason::Deadline) => failed(too_late(), remarks),
        None => {
            let reason = "the solver stopped without a request";
            failed(internal(reason.to_owned()), remarks)
        }
    };
    match outcome {
        Outcome::Solved { .. } | Outcome::Slice { .. } if reason == Some(StopReason::Lost) => {
            Disposition::Discard
        }
        // A slice is kept like an answer as long as the whole is still wanted.
        Outcome::Slice { sliced, part }
            if matches!(
                reason,
                None | Some(StopReason::Shutdown | StopReason::TooLong)
            ) =>
        {
            Disposition::StoreSlice {
                sliced,
                part,
                stopped: reason,
            }
        }
        Outcome::Solved {
            result,
            remarks,
            field_patches,
        } => Disposition::Store {
            result,
            remarks,
            field_patches,
        },
        Outcome::Unsolved {
            error: SolveError::Cancelled,
            remarks,
        } => stopped(remarks),
        Outcome::Slice { sliced, .. } => stopped(sliced.remarks()),
        Outcome::Abandoned => stopped(Vec::new()),
        Outcome::Unsolved { error, remarks } => {
            let failure = Failure::of_solve(&error);
            failed(
                failure.unwrap_or_else(|| internal(error.to_string())),
                remarks,
            )
        }
        Outcome::Refused(error) => {
            let reason = format!("the stored case is no longer accepted: {error}");
            failed(internal(reason), Vec::new())
        }
        Outcome::Broken(failure) => failed(failure, Vec::new()),
    }
}

impl Worker {
    /// Stores a solved slice of a member, which goes on from there; `false` if the lease is lost.
    pub(crate) async fn keep_slice(
        &self,
        attempt: &mut Attempt,
        place: usize,
        mut sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
    ) -> Result<bool> {
        let shared = &self.shared;
        let member = &mut attempt.members[place];
        if let Some((note, part)) = part {
            let claim = &member.claim;
            let (number, done) = (note.number, sliced.done_after_next());
            let result = self.store_result(claim, Some(number), part).await?;
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
                return Ok(false);
            }
            tracing::debug!(job = %claim.id, number, done, "slice stored");
            sliced.advance(slice.note.spent);
            member.claim.slices = number + 1;
        }
        member.sliced = Some(sliced);
        Ok(true)
    }

    /// What is to be done next for a sweep.
    pub(crate) async fn next_of(&self, id: Uuid, mut sliced: Box<SlicedWork>) -> Result<Work> {
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
    async fn parts(&self, id: Uuid) -> Result<Vec<EncodedResult>> {
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

impl Worker {
    /// Reads the cases of the claimed jobs, and ends those whose result has been there since they were queued. To be called once the
    /// leases are kept: a cancellation is then either read here or finds the control of the job.
    pub(crate) async fn read_cases(
        &self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<()> {
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
    ) -> Result<()> {
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
    pub(crate) async fn record(&self, attempt: &mut Attempt, step: &mut StepReport) -> Result<()> {
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
                Ok(false) => return pending.lost.push(claim.id),
                Ok(true) => match stopped {
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
                .store_result(&claim, None, result)
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
    ) -> Result<()> {
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
    async fn settle_duplicates(&self, attempt: &mut Attempt, step: &mut StepReport) -> Result<()> {
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
        slice: Option<u32>,
        result: EncodedResult,
    ) -> Result<StoredResult> {
        let shared = &self.shared;
        // Other programs read the answers of rows where they lie.
        if !result.is_rows() && result.bytes() <= shared.options.small_result_max_bytes {
            return Ok(StoredResult::Inline(result));
        }
        let bytes = result.bytes() as u64;
        let key = shared
            .write_with_retries(StoragePlace::Results, || {
                shared.blobs.put(claim, slice, result.clone())
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
    ) -> Result<()> {
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
    let detail = "the result could not be stored; the log of the service says why";
    Ending::Failed {
        failure: Failure::new(FailureKind::Internal, detail),
        remarks: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attempts::slices::SlicedCase;
    use railhead_contact::error::CaseError;

    fn checked() -> railhead_contact::problem::checked_case::CheckedCase {
        let case = serde_json::json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": [{ "creepage_x": 0.001 }, { "creepage_x": 0.002 }]
        });
        railhead_contact::check(&case, &railhead_contact::case::solver::Limits::default()).unwrap()
    }

    /// What becomes of a job, as a word.
    fn fate(outcome: Outcome, reason: Option<StopReason>) -> &'static str {
        match disposition_of(outcome, reason) {
            Disposition::Store { .. } => "kept",
            Disposition::StoreSlice { stopped: None, .. } => "goes on",
            Disposition::StoreSlice { .. } => "part kept",
            Disposition::End(ending) => ending.state().name(),
            Disposition::Release => "back",
            Disposition::ReleaseAsLong => "back, long",
            Disposition::Discard => "lost",
        }
    }

    #[test]
    fn every_outcome_has_one_consequence_whatever_the_solver_was_told() {
        let reasons = [
            None,
            Some(StopReason::Cancel),
            Some(StopReason::Shutdown),
            Some(StopReason::Lost),
            Some(StopReason::Deadline),
            Some(StopReason::TooLong),
        ];
        let solved = || Outcome::Solved {
            result: EncodedResult {
                solution: "{}".into(),
                fields: None,
            },
            remarks: Vec::new(),
            field_patches: 0,
        };
        let slice = || Outcome::Slice {
            sliced: Box::new(SlicedWork::Case(SlicedCase::new(
                checked(),
                vec![0..1, 1..2],
                &[],
            ))),
            part: None,
        };
        let broken = || Outcome::Broken(Failure::new(FailureKind::Panic, "boom"));
        let stopped = || Outcome::Unsolved {
            error: SolveError::Cancelled,
            remarks: Vec::new(),
        };
        let late = || Outcome::Refused(CaseError(Vec::new()));
        for reason in reasons {
            // An answer counts even if it came while the solver was told to stop, unless the job is somebody else's.
            let kept = if reason == Some(StopReason::Lost) {
                "lost"
            } else {
                "kept"
            };
            assert_eq!(fate(solved(), reason), kept, "{reason:?}");
            // A slice is kept where the whole is still wanted.
            let part = match reason {
                None => "goes on",
                Some(StopReason::Shutdown | StopReason::TooLong) => "part kept",
                Some(StopReason::Lost) => "lost",
                Some(StopReason::Cancel) => "cancelled",
                Some(StopReason::Deadline) => "failed",
            };
            assert_eq!(fate(slice(), reason), part, "{reason:?}");
            let told = match reason {
                None | Some(StopReason::Deadline) => "failed",
                Some(StopReason::Cancel) => "cancelled",
                Some(StopReason::Shutdown) => "back",
                Some(StopReason::Lost) => "lost",
                Some(StopReason::TooLong) => "back, long",
            };
            assert_eq!(fate(stopped(), reason), told, "{reason:?}");
            assert_eq!(fate(Outcome::Abandoned, reason), told, "{reason:?}");
            assert_eq!(fate(broken(), reason), "failed", "{reason:?}");
            assert_eq!(fate(late(), reason), "failed", "{reason:?}");
        }
    }
}
