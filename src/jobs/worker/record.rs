//! Records the outcomes of solvers. [`disposition_of`] is the one place that decides the effect of an outcome on its job.
use std::collections::HashSet;
use std::time::SystemTime;

use uuid::Uuid;

use crate::attempts::attempt::{Attempt, Phase, StopReason};
use crate::attempts::slices::{Outcome, SlicedWork, Solved, Work, internal_failure};
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::model::{Failure, FailureKind, too_late};
use crate::storage_fault::StoragePlace;
use crate::store::{Claim, Ending, NewSlice, ReleaseReason, SliceRecord, StoredResult};
use crate::submit::microseconds;
use crate::trace::JobTrace;
use crate::worker::pool::{StepReport, Worker};
use railhead_contact::error::SolveError;

/// Effect of an outcome on its job.
pub(crate) enum Disposition {
    /// Store a solved slice, if there is one. Then release the job if it was stopped, else solve the next slice.
    StoreSlice {
        sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
        stopped: Option<StopReason>,
    },
    /// Store the result, then end the job.
    Store(Solved),
    /// End the job without a result.
    End(Ending),
    /// Return the job to the queue without counting the attempt.
    Release,
    /// As [`Disposition::Release`], and increase the expected time of its slices.
    ReleaseAsLong,
    /// The lease was lost: discard the outcome.
    Discard,
}

/// The effect of an outcome, given the reason for which the solver was stopped, if it was.
pub(crate) fn disposition_of(outcome: Outcome, reason: Option<StopReason>) -> Disposition {
    let failed = |failure, remarks| Disposition::End(Ending::Failed { failure, remarks });
    let stopped = |remarks| match reason {
        Some(StopReason::Cancel) => Disposition::End(Ending::Cancelled),
        Some(StopReason::Shutdown) => Disposition::Release,
        Some(StopReason::TooLong) => Disposition::ReleaseAsLong,
        Some(StopReason::Lost) => Disposition::Discard,
        Some(StopReason::Deadline) => failed(too_late(), remarks),
        None => {
            let failure = internal_failure("the solver stopped without a request");
            failed(failure, remarks)
        }
    };
    match outcome {
        Outcome::Solved(_) | Outcome::Slice { .. } if reason == Some(StopReason::Lost) => {
            Disposition::Discard
        }
        // A slice is stored like a result unless the job is cancelled.
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
        Outcome::Solved(solved) => Disposition::Store(solved),
        Outcome::Unsolved {
            error: SolveError::Cancelled,
            remarks,
        } => stopped(remarks),
        Outcome::Slice { sliced, .. } => stopped(sliced.remarks()),
        Outcome::Abandoned => stopped(Vec::new()),
        Outcome::Unsolved { error, remarks } => {
            let failure = Failure::of_solve(&error);
            let internal = || internal_failure(&error.to_string());
            failed(failure.unwrap_or_else(internal), remarks)
        }
        Outcome::Refused(error) => {
            let reason = format!("the stored case is no longer accepted: {error}");
            failed(internal_failure(&reason), Vec::new())
        }
        Outcome::Broken(failure) => failed(failure, Vec::new()),
    }
}

impl Worker {
    /// Stores a solved slice of a member, which continues from there; `false` if the lease was lost.
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
            let (number, (done, rest_s)) = (note.number, sliced.progress());
            let result = self.store_result(claim, Some(number), part).await?;
            let slice = NewSlice {
                rest_us: u64::from(microseconds(rest_s)),
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
            sliced.spent = slice.note.spent;
            sliced.done += 1;
            member.claim.slices = sliced.done;
        }
        member.sliced = Some(sliced);
        Ok(true)
    }

    /// The next task of a sweep.
    pub(crate) async fn next_of(&self, id: Uuid, mut sliced: Box<SlicedWork>) -> Result<Work> {
        if !sliced.waits_for_parts() {
            return Ok(Work::Next(sliced));
        }
        match self.parts(id).await {
            Ok(parts) => Ok(Work::Join(sliced, parts)),
            Err(error) if error.storage_fault().is_some() => Err(error),
            Err(error) => {
                tracing::error!(job = %id, %error, "the stored slices cannot be read; the job is solved again");
                sliced.begin_again();
                Ok(Work::Next(sliced))
            }
        }
    }

    /// Reads the stored slices of a sweep.
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
    /// Reads the cases of the claimed jobs, and ends jobs whose result is in the cache by now. Called while the leases are
    /// held: a cancellation is then either read here or finds the control of the job.
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

    /// Ends claimed jobs with the results of other jobs. If such a result was removed, the job returns to the queue.
    async fn answer_with(
        &self,
        attempt: &mut Attempt,
        pairs: Vec<(Claim, Uuid)>,
        step: &mut StepReport,
    ) -> Result<()> {
        let ends = pairs.into_iter();
        let ends = ends.map(|(claim, source)| (claim, Ending::Cached { source }));
        let back = self
            .finish(attempt, ends.collect(), SystemTime::now(), step)
            .await?;
        self.release(attempt, &back, ReleaseReason::SolveItself, step)
            .await
    }

    /// Records the outcomes of the members that have one.
    pub(crate) async fn record(&self, attempt: &mut Attempt, step: &mut StepReport) -> Result<()> {
        let from = SystemTime::now();
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
        let PendingWrites {
            ends,
            mut back,
            long,
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

    /// Stores the result or slice of a member, and collects the remaining writes.
    async fn apply(
        &self,
        attempt: &mut Attempt,
        place: usize,
        disposition: Disposition,
        pending: &mut PendingWrites,
    ) {
        let claim = attempt.members[place].claim.clone();
        let stored = match disposition {
            Disposition::Discard => return attempt.done(&[claim.id]),
            Disposition::Release => return pending.back.push(claim),
            Disposition::ReleaseAsLong => return pending.long.push(claim),
            Disposition::End(ending) => Ok(ending),
            Disposition::StoreSlice {
                sliced,
                part,
                stopped,
            } => match self.keep_slice(attempt, place, sliced, part).await {
                Ok(false) => return attempt.done(&[claim.id]),
                Ok(true) => match stopped {
                    Some(StopReason::TooLong) => return pending.long.push(claim),
                    Some(_) => return pending.back.push(claim),
                    None if self.makes_room(attempt).await => return pending.back.push(claim),
                    None => return attempt.members[place].phase = Phase::Solving,
                },
                Err(error) => Err(error),
            },
            Disposition::Store(solved) => {
                let result = self.store_result(&claim, None, solved.result).await;
                result.map(|result| Ending::Succeeded {
                    remarks: solved.remarks,
                    result,
                    field_patches: solved.field_patches,
                })
            }
        };
        match stored {
            Ok(ending) => pending.ends.push((claim, ending)),
            // The service stops while storage rejects writes.
            Err(error) if error.storage_fault().is_some() => pending.back.push(claim),
            Err(error) => pending.ends.push((claim, not_stored(&error))),
        }
    }

    /// Ends claimed jobs. Returns those that were to get a result that has been removed; they are still held.
    async fn finish(
        &self,
        attempt: &mut Attempt,
        ends: Vec<(Claim, Ending)>,
        from: SystemTime,
        step: &mut StepReport,
    ) -> Result<Vec<Claim>> {
        let mut back = Vec::new();
        if ends.is_empty() {
            return Ok(back);
        }
        let shared = &self.shared;
        // Results survive a temporary failure of the database.
        let ended = shared
            .write_with_retries(StoragePlace::Table, || {
                shared.store.finish(&ends, shared.now_ms())
            })
            .await?;
        for (claim, ending) in &ends {
            if ended.contains(&claim.id) {
                let cached = matches!(ending, Ending::Cached { .. });
                if let Some(traced) = JobTrace::of(shared.options.tracer.as_ref(), claim) {
                    if cached {
                        traced.waited_until(from);
                    }
                    traced.stored(from, ending.state().name());
                }
                shared.metrics.cache_lookup(u64::from(cached), 0);
                shared.metrics.ending(ending);
                shared.announce(claim.id);
                step.ended.push((claim.id, ending.state()));
            } else {
                match ending {
                    Ending::Cached { .. } => back.push(claim.clone()),
                    Ending::Succeeded {
                        result: StoredResult::Blob(key, _),
                        ..
                    } => self.abandon_blob(key).await,
                    _ => {}
                }
            }
        }
        let ids = ends.iter().map(|(claim, _)| claim.id);
        let ids = ids.filter(|id| back.iter().all(|claim| claim.id != *id));
        attempt.done(&ids.collect::<Vec<_>>());
        if ends.iter().any(|(claim, _)| claim.slices > 0) {
            shared.collect_blobs().await;
        }
        Ok(back)
    }

    /// Registers a result without a job for removal.
    pub(crate) async fn abandon_blob(&self, key: &str) {
        if let Err(error) = self.shared.store.abandon_blob(key).await {
            tracing::warn!(key, %error, "a result without a job is left until the next start");
        }
    }

    /// Ends members that waited for an equal one with its result; without a result they return to the queue.
    async fn settle_duplicates(&self, attempt: &mut Attempt, step: &mut StepReport) -> Result<()> {
        let solving: HashSet<Uuid> = attempt
            .claims(|phase| matches!(phase, Phase::Solving))
            .iter()
            .map(|claim| claim.id)
            .collect();
        let members = attempt.members.iter();
        let pairs = members.filter_map(|member| match member.phase {
            Phase::WaitingFor(first) if !solving.contains(&first) => {
                Some((member.claim.clone(), first))
            }
            _ => None,
        });
        let pairs = pairs.collect();
        self.answer_with(attempt, pairs, step).await
    }

    /// Stores a large result outside the table; a small one is stored later with the end of its job.
    async fn store_result(
        &self,
        claim: &Claim,
        slice: Option<u32>,
        result: EncodedResult,
    ) -> Result<StoredResult> {
        let shared = &self.shared;
        // Other programs read the files of rows directly.
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
        // While the store is unavailable the jobs stay claimed: an expired lease would count as an attempt.
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
        let ids: Vec<_> = claims.iter().map(|claim| claim.id).collect();
        attempt.done(&ids);
        shared.wake_workers();
        Ok(())
    }
}

/// Writes for the members of an attempt, combined into few transactions.
#[derive(Default)]
struct PendingWrites {
    ends: Vec<(Claim, Ending)>,
    back: Vec<Claim>,
    long: Vec<Claim>,
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

    /// The effect of an outcome as a word.
    fn fate(outcome: Outcome, reason: Option<StopReason>) -> &'static str {
        match disposition_of(outcome, reason) {
            Disposition::Store(_) => "kept",
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
        let solved = || {
            Outcome::Solved(Solved {
                result: EncodedResult {
                    solution: "{}".into(),
                    fields: None,
                },
                remarks: Vec::new(),
                field_patches: 0,
            })
        };
        let slice = || Outcome::Slice {
            sliced: Box::new(SlicedWork::case(checked(), vec![0..1, 1..2], &[])),
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
