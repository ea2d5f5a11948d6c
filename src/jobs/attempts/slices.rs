//! Slices of a case: where it is divided, which slices are solved, and the outcome of a solver thread.
//!
//! The division depends on the case alone, so that the stored slices of a crashed process remain usable.
use std::ops::Range;
use std::time::Duration;

use crate::codec::result::EncodedResult;
use crate::model::{Failure, FailureKind};
use crate::store::{SliceRecord, StoredCase};
use railhead_contact::error::{CaseError, SolveError};
use railhead_contact::evolution::task::Evolution;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::solution::words::evolution::EvolutionState;

/// A checked case with its slices, the first `done` of which are stored.
#[derive(Debug)]
pub(crate) struct SlicedCase {
    pub(crate) checked: CheckedCase,
    pub(crate) slices: Vec<Range<usize>>,
    pub(crate) done: usize,
    /// Solver time of the stored slices.
    pub(crate) spent: Duration,
}

impl SlicedCase {
    /// A case with its stored slices. Slices with another division or of another solver revision are ignored.
    pub(crate) fn new(
        checked: CheckedCase,
        slices: Vec<Range<usize>>,
        stored: &[SliceRecord],
    ) -> SlicedCase {
        let fits = |(place, (note, slice)): (usize, (&SliceRecord, &Range<usize>))| {
            note.number as usize == place
                && note.motions as usize == slice.end
                && note.digest == checked.label.digest
        };
        let pairs = stored.iter().zip(&slices).enumerate();
        let done = pairs.take_while(|pair| fits(*pair)).count();
        let last = done.checked_sub(1).and_then(|last| stored.get(last));
        SlicedCase {
            spent: last.map_or(Duration::ZERO, |note| note.spent),
            checked,
            slices,
            done,
        }
    }

    /// The next slice, if any is left.
    pub(crate) fn next(&self) -> Option<Range<usize>> {
        self.slices.get(self.done).cloned()
    }

    /// The record of the next slice; `spent` is the solver time of the job up to its end.
    pub(crate) fn note(&self, spent: Duration) -> SliceRecord {
        let motions = self.next().map_or(0, |slice| slice.end);
        SliceRecord {
            number: u32::try_from(self.done).unwrap_or(u32::MAX),
            motions: u32::try_from(motions).unwrap_or(u32::MAX),
            digest: self.checked.label.digest.clone(),
            spent,
        }
    }

    /// Fraction of the motions that are solved after the next slice.
    pub(crate) fn done_after_next(&self) -> f64 {
        let motions = self.next().map_or(0, |slice| slice.end);
        motions as f64 / self.checked.problem.motions.len().max(1) as f64
    }
}

/// An evolution between two slices.
#[derive(Debug)]
pub(crate) struct SlicedEvolution {
    pub(crate) task: Evolution,
    /// Current state; `None` if it has to be read from the stored slices.
    pub(crate) state: Option<EvolutionState>,
    /// Number of stored slices.
    pub(crate) done: u32,
    /// Solver time of the stored slices.
    pub(crate) spent: Duration,
}

impl SlicedEvolution {
    /// An evolution with its stored slices. Slices of another solver revision are ignored.
    pub(crate) fn new(task: Evolution, stored: &[SliceRecord]) -> SlicedEvolution {
        let fit = stored.iter().all(|note| note.digest == task.digest);
        let stored = if fit { stored } else { &[] };
        SlicedEvolution {
            state: stored.is_empty().then(|| task.begin()),
            done: u32::try_from(stored.len()).unwrap_or(u32::MAX),
            spent: stored.last().map_or(Duration::ZERO, |note| note.spent),
            task,
        }
    }

    /// Starts again, because the stored slices cannot be used.
    pub(crate) fn begin_again(&mut self) {
        self.done = 0;
        self.state = Some(self.task.begin());
    }
}

/// Work that is solved slice by slice.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "it is always boxed")]
pub(crate) enum SlicedWork {
    /// A case, cut by its motions.
    Case(SlicedCase),
    /// An evolution, cut by its steps.
    Evolution(SlicedEvolution),
}

impl SlicedWork {
    /// Whether the stored slices have to be read first: because all are solved, or because they contain the current state.
    pub(crate) fn waits_for_parts(&self) -> bool {
        match self {
            SlicedWork::Case(case) => case.next().is_none(),
            SlicedWork::Evolution(evolution) => evolution.state.is_none(),
        }
    }

    /// Remarks of the check.
    pub(crate) fn remarks(self) -> Vec<RemarkEntry> {
        match self {
            SlicedWork::Case(case) => case.checked.remarks,
            SlicedWork::Evolution(_) => Vec::new(),
        }
    }

    /// Fraction of the work that is done once the last solved slice is stored.
    pub(crate) fn done_after_next(&self) -> f64 {
        match self {
            SlicedWork::Case(case) => case.done_after_next(),
            SlicedWork::Evolution(own) => own.state.as_ref().map_or(0.0, |state| state.share),
        }
    }

    /// Expected remaining solve time in s after the fraction `done`.
    pub(crate) fn seconds_left(&self, done: f64) -> f64 {
        (1.0 - done)
            * match self {
                SlicedWork::Case(case) => case.checked.cost().seconds,
                SlicedWork::Evolution(evolution) => evolution.task.expected_seconds(),
            }
    }

    /// Records that the last solved slice is stored.
    pub(crate) fn advance(&mut self, spent: Duration) {
        match self {
            SlicedWork::Case(case) => {
                case.done += 1;
                case.spent = spent;
            }
            SlicedWork::Evolution(evolution) => {
                evolution.done += 1;
                evolution.spent = spent;
            }
        }
    }

    /// Starts again, because the stored slices cannot be used.
    pub(crate) fn begin_again(&mut self) {
        match self {
            SlicedWork::Case(case) => case.done = 0,
            SlicedWork::Evolution(evolution) => evolution.begin_again(),
        }
    }
}

/// The result of a job in its stored form.
#[derive(Debug)]
pub(crate) struct Solved {
    pub(crate) result: EncodedResult,
    pub(crate) remarks: Vec<RemarkEntry>,
    /// Number of patches with stored fields; of a chunk of rows, number of rows without an answer.
    pub(crate) field_patches: u32,
}

/// Outcome of a task of a solver thread.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// The job is solved.
    Solved(Solved),
    /// A slice in its stored form, if one was solved; further slices follow.
    Slice {
        sliced: Box<SlicedWork>,
        part: Option<(SliceRecord, EncodedResult)>,
    },
    /// The solver failed or was stopped. The remarks are those of the check.
    Unsolved {
        error: SolveError,
        remarks: Vec<RemarkEntry>,
    },
    /// The stored case is no longer valid.
    Refused(CaseError),
    /// The service failed.
    Broken(Failure),
    /// The solver ignored a stop request, and its thread was abandoned.
    Abandoned,
}

/// The outcome of work. The `Err` is an outcome that ends the work early, so that `?` returns it.
pub(crate) type Ended = Result<Outcome, Box<Outcome>>;

impl From<SolveError> for Box<Outcome> {
    fn from(error: SolveError) -> Box<Outcome> {
        Box::new(Outcome::Unsolved {
            error,
            remarks: Vec::new(),
        })
    }
}

impl From<CaseError> for Box<Outcome> {
    fn from(error: CaseError) -> Box<Outcome> {
        Box::new(Outcome::Refused(error))
    }
}

/// Converts the reason of an internal error.
impl From<String> for Box<Outcome> {
    fn from(reason: String) -> Box<Outcome> {
        Box::new(Outcome::Broken(internal_failure(&reason)))
    }
}

/// Next task for a job.
#[derive(Debug)]
pub(crate) enum Work {
    /// Check the case, which has these stored slices, and solve the next slice.
    New(StoredCase, Vec<SliceRecord>),
    /// Solve the next slice.
    Next(Box<SlicedWork>),
    /// Join the parts of the stored slices.
    Join(Box<SlicedWork>, Vec<EncodedResult>),
}

/// The failure of a job because of an internal error, whose reason is logged.
pub(crate) fn internal_failure(reason: &str) -> Failure {
    tracing::error!(reason, "a job fails inside the service");
    let detail = "the job could not be solved because of a fault of the service; its log has the reason under the id of the job";
    Failure::new(FailureKind::Internal, detail)
}

#[cfg(test)]
pub(crate) mod tests {
    use serde_json::json;

    use super::*;
    use railhead_contact as contact;
    use railhead_contact::case::solver::Limits;

    /// Seven motions with all fields.
    pub(crate) fn checked_case() -> CheckedCase {
        let case = json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": { "sweep": { "creepage_x": { "from": 0.0005, "to": 0.003, "points": 7 } } },
            "solver": { "mesh": { "strips": 6, "cells": 6 } },
            "outputs": ["resultants", "zones", "tractions", "slip", "pressure"]
        });
        contact::check(&case, &Limits::default()).unwrap()
    }

    fn note(number: u32, motions: u32, checked: &CheckedCase) -> SliceRecord {
        SliceRecord {
            number,
            motions,
            digest: checked.label.digest.clone(),
            spent: Duration::from_secs(u64::from(motions)),
        }
    }

    #[test]
    fn only_what_was_cut_here_and_solved_by_this_solver_counts_as_done() {
        let checked = checked_case();
        let cuts = || vec![0..3, 3..5, 5..7];
        let sliced = |stored: &[SliceRecord]| SlicedCase::new(checked.clone(), cuts(), stored);
        let good = [note(0, 3, &checked), note(1, 5, &checked)];
        let going = sliced(&good);
        assert_eq!(
            (going.next(), going.spent),
            (Some(5..7), Duration::from_secs(5))
        );
        assert_eq!(going.note(Duration::ZERO).motions, 7);
        assert!((going.done_after_next() - 1.0).abs() < f64::EPSILON);
        assert_eq!(sliced(&[]).next(), Some(0..3));
        // Cut elsewhere, a hole, another solver.
        assert_eq!(sliced(&[note(0, 2, &checked)]).next(), Some(0..3));
        assert_eq!(sliced(&good[1..]).next(), Some(0..3));
        let other = SliceRecord {
            digest: "of another revision".to_owned(),
            ..good[1].clone()
        };
        let half = sliced(&[good[0].clone(), other]);
        assert_eq!(
            (half.next(), half.spent),
            (Some(3..5), Duration::from_secs(3))
        );
    }
}
