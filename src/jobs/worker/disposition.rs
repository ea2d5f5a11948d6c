//! What follows for a job from the outcome of its solver and from the reason for which the solver was told to stop. This is the
//! one place that decides it.

use crate::contact::error::SolveError;
use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::attempts::attempt_control::StopReason;
use crate::jobs::attempts::outcome::{INTERNAL, Outcome};
use crate::jobs::attempts::slices::SlicedWork;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::model::job::{Failure, FailureKind, too_late};
use crate::jobs::store::ending::{Ending, SliceRecord};

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
    let failed = |reason: String| {
        tracing::error!(reason, "a job fails inside the service");
        Disposition::End(Ending::Failed(Failure::new(
            FailureKind::Internal,
            INTERNAL,
        )))
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
        Outcome::Unsolved(SolveError::Cancelled) | Outcome::Abandoned | Outcome::Slice { .. } => {
            match reason {
                Some(StopReason::Cancel) => Disposition::End(Ending::Cancelled),
                Some(StopReason::Shutdown) => Disposition::Release,
                Some(StopReason::TooLong) => Disposition::ReleaseAsLong,
                Some(StopReason::Lost) => Disposition::Discard,
                Some(StopReason::Deadline) => Disposition::End(Ending::Failed(too_late())),
                None => failed("the solver stopped although nobody asked it to".to_owned()),
            }
        }
        Outcome::Unsolved(error) => match Failure::of_solve(&error) {
            Some(failure) => Disposition::End(Ending::Failed(failure)),
            None => failed(error.to_string()),
        },
        Outcome::Refused(error) => {
            failed(format!("the stored case is no longer accepted: {error}"))
        }
        Outcome::Broken(failure) => Disposition::End(Ending::Failed(failure)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::error::CaseError;
    use crate::jobs::attempts::slices::SlicedCase;

    fn checked() -> crate::contact::problem::checked_case::CheckedCase {
        let case = serde_json::json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": [{ "creepage_x": 0.001 }, { "creepage_x": 0.002 }]
        });
        crate::contact::check(&case, &crate::contact::case::solver::Limits::default()).unwrap()
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
        let stopped = || Outcome::Unsolved(SolveError::Cancelled);
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
