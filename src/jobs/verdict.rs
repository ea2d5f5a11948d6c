//! What becomes of a job after an attempt: from the outcome of the solver and from what it was told, in one place.

use crate::contact::error::SolveError;
use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::job::{Failure, FailureKind};
use crate::jobs::results::Encoded;
use crate::jobs::solver_thread::{INTERNAL, Outcome};
use crate::jobs::store::Ending;
use crate::jobs::sweep::{SliceNote, Sweep};
use crate::jobs::watch::Reason;
use crate::jobs::wishes::too_late;

/// What follows from the outcome of an attempt.
pub(super) enum Verdict {
    /// There is a part of an answer to keep, if any, and more to be solved: now, or by somebody else later.
    GoOn {
        sweep: Box<Sweep>,
        part: Option<(SliceNote, Encoded)>,
        stopped: Option<Reason>,
    },
    /// There is an answer to keep.
    Keep {
        result: Encoded,
        remarks: Vec<RemarkEntry>,
        field_patches: u32,
    },
    /// The job ends without one.
    End(Ending),
    /// The job goes back to the queue, its attempt uncounted.
    HandBack,
    /// As before; its solve takes longer than was thought.
    HandBackAsLong,
    /// The lease is gone.
    Lost,
}

/// What follows from the outcome of an attempt; the one place that decides it.
pub(super) fn judge(outcome: Outcome, reason: Option<Reason>) -> Verdict {
    let failed = |reason: String| {
        tracing::error!(reason, "a job fails inside the service");
        Verdict::End(Ending::Failed(Failure::new(
            FailureKind::Internal,
            INTERNAL,
        )))
    };
    match outcome {
        Outcome::Solved { .. } | Outcome::Slice { .. } if reason == Some(Reason::Lost) => {
            Verdict::Lost
        }
        // A slice counts like an answer where somebody wants the whole.
        Outcome::Slice { sweep, part }
            if matches!(reason, None | Some(Reason::Shutdown | Reason::TooLong)) =>
        {
            Verdict::GoOn {
                sweep,
                part,
                stopped: reason,
            }
        }
        Outcome::Solved {
            result,
            remarks,
            field_patches,
        } => Verdict::Keep {
            result,
            remarks,
            field_patches,
        },
        Outcome::Unsolved(SolveError::Cancelled) | Outcome::Abandoned | Outcome::Slice { .. } => {
            match reason {
                Some(Reason::Cancel) => Verdict::End(Ending::Cancelled),
                Some(Reason::Shutdown) => Verdict::HandBack,
                Some(Reason::TooLong) => Verdict::HandBackAsLong,
                Some(Reason::Lost) => Verdict::Lost,
                Some(Reason::Deadline) => Verdict::End(Ending::Failed(too_late())),
                None => failed("the solver stopped although nobody asked it to".to_owned()),
            }
        }
        Outcome::Unsolved(error) => match Failure::of_solve(&error) {
            Some(failure) => Verdict::End(Ending::Failed(failure)),
            None => failed(error.to_string()),
        },
        Outcome::Refused(error) => {
            failed(format!("the stored case is no longer accepted: {error}"))
        }
        Outcome::Broken(failure) => Verdict::End(Ending::Failed(failure)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::error::CaseError;

    fn problem() -> crate::contact::case::problem::Problem {
        let case = serde_json::json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": [{ "creepage_x": 0.001 }, { "creepage_x": 0.002 }]
        });
        crate::contact::check(&case, &crate::contact::case::limits::Limits::default()).unwrap()
    }

    /// What becomes of a job, as a word.
    fn fate(outcome: Outcome, reason: Option<Reason>) -> &'static str {
        match judge(outcome, reason) {
            Verdict::Keep { .. } => "kept",
            Verdict::GoOn { stopped: None, .. } => "goes on",
            Verdict::GoOn { .. } => "part kept",
            Verdict::End(ending) => ending.state().name(),
            Verdict::HandBack => "back",
            Verdict::HandBackAsLong => "back, long",
            Verdict::Lost => "lost",
        }
    }

    #[test]
    fn every_outcome_has_one_consequence_whatever_the_solver_was_told() {
        let reasons = [
            None,
            Some(Reason::Cancel),
            Some(Reason::Shutdown),
            Some(Reason::Lost),
            Some(Reason::Deadline),
            Some(Reason::TooLong),
        ];
        let solved = || Outcome::Solved {
            result: Encoded {
                solution: "{}".into(),
                fields: None,
            },
            remarks: Vec::new(),
            field_patches: 0,
        };
        let slice = || Outcome::Slice {
            sweep: Box::new(Sweep::new(problem(), vec![0..1, 1..2], &[])),
            part: None,
        };
        let broken = || Outcome::Broken(Failure::new(FailureKind::Panic, "boom"));
        let stopped = || Outcome::Unsolved(SolveError::Cancelled);
        let late = || Outcome::Refused(CaseError(Vec::new()));
        for reason in reasons {
            // An answer counts even if it came while the solver was told to stop, unless the job is somebody else's.
            let kept = if reason == Some(Reason::Lost) {
                "lost"
            } else {
                "kept"
            };
            assert_eq!(fate(solved(), reason), kept, "{reason:?}");
            // A slice is kept where the whole is still wanted.
            let part = match reason {
                None => "goes on",
                Some(Reason::Shutdown | Reason::TooLong) => "part kept",
                Some(Reason::Lost) => "lost",
                Some(Reason::Cancel) => "cancelled",
                Some(Reason::Deadline) => "failed",
            };
            assert_eq!(fate(slice(), reason), part, "{reason:?}");
            let told = match reason {
                None | Some(Reason::Deadline) => "failed",
                Some(Reason::Cancel) => "cancelled",
                Some(Reason::Shutdown) => "back",
                Some(Reason::Lost) => "lost",
                Some(Reason::TooLong) => "back, long",
            };
            assert_eq!(fate(stopped(), reason), told, "{reason:?}");
            assert_eq!(fate(Outcome::Abandoned, reason), told, "{reason:?}");
            assert_eq!(fate(broken(), reason), "failed", "{reason:?}");
            assert_eq!(fate(late(), reason), "failed", "{reason:?}");
        }
    }
}
