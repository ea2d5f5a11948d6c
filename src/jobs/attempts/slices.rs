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

/// Work that is solved slice by slice.
#[derive(Debug)]
pub(crate) struct SlicedWork {
    pub(crate) task: SlicedTask,
    /// Number of stored slices.
    pub(crate) done: u32,
    /// Solver time of the stored slices.
    pub(crate) spent: Duration,
}

/// The kinds of work that is solved slice by slice.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "it is always boxed")]
pub(crate) enum SlicedTask {
    /// A case, cut by its motions.
    Case {
        checked: CheckedCase,
        slices: Vec<Range<usize>>,
    },
    /// An evolution, cut by its steps. Its current state is `None` if it has to be read from the stored slices.
    Evolution {
        task: Evolution,
        state: Option<EvolutionState>,
    },
}

impl SlicedWork {
    /// A case with its stored slices. Slices with another division or of another solver revision are ignored.
    pub(crate) fn case(
        checked: CheckedCase,
        slices: Vec<Range<usize>>,
        stored: &[SliceRecord],
    ) -> SlicedWork {
        let fits = |(place, (record, slice)): (usize, (&SliceRecord, &Range<usize>))| {
            record.number as usize == place
                && record.motions as usize == slice.end
                && record.digest == checked.label.digest
        };
        let pairs = stored.iter().zip(&slices).enumerate();
        let done = pairs.take_while(|pair| fits(*pair)).count();
        SlicedWork::begun(SlicedTask::Case { checked, slices }, &stored[..done])
    }

    /// An evolution with its stored slices. Slices of another solver revision are ignored.
    pub(crate) fn evolution(task: Evolution, stored: &[SliceRecord]) -> SlicedWork {
        let fit = stored.iter().all(|record| record.digest == task.digest);
        let stored = if fit { stored } else { &[] };
        let state = stored.is_empty().then(|| task.begin());
        SlicedWork::begun(SlicedTask::Evolution { task, state }, stored)
    }

    fn begun(task: SlicedTask, stored: &[SliceRecord]) -> SlicedWork {
        SlicedWork {
            task,
            done: u32::try_from(stored.len()).unwrap_or(u32::MAX),
            spent: stored.last().map_or(Duration::ZERO, |last| last.spent),
        }
    }

    /// Whether the stored slices have to be read first: because all are solved, or because they contain the current state.
    pub(crate) fn waits_for_parts(&self) -> bool {
        match &self.task {
            SlicedTask::Case { slices, .. } => self.done as usize >= slices.len(),
            SlicedTask::Evolution { task, state } => {
                state.as_ref().is_none_or(|state| task.is_over(state))
            }
        }
    }

    /// Remarks of the check.
    pub(crate) fn remarks(self) -> Vec<RemarkEntry> {
        match self.task {
            SlicedTask::Case { checked, .. } => checked.remarks,
            SlicedTask::Evolution { .. } => Vec::new(),
        }
    }

    /// The record of the last solved slice, which is not stored yet. `motions` is the number of motions or steps up to its
    /// end, and `spent` the solver time.
    pub(crate) fn record(&self, motions: usize, spent: Duration) -> SliceRecord {
        let digest = match &self.task {
            SlicedTask::Case { checked, .. } => &checked.label.digest,
            SlicedTask::Evolution { task, .. } => &task.digest,
        };
        SliceRecord {
            number: self.done,
            motions: u32::try_from(motions).unwrap_or(u32::MAX),
            digest: digest.clone(),
            spent,
        }
    }

    /// Fraction of the work that is done with the last solved slice, which is not stored yet, and the expected solve time of
    /// the rest in s.
    pub(crate) fn progress(&self) -> (f64, f64) {
        let (done, seconds) = match &self.task {
            SlicedTask::Case { checked, slices } => {
                let motions = slices.get(self.done as usize).map_or(0, |slice| slice.end);
                let done = motions as f64 / checked.problem.motions.len().max(1) as f64;
                (done, checked.cost().seconds)
            }
            SlicedTask::Evolution { task, state } => {
                let done = state.as_ref().map_or(0.0, |state| state.share);
                (done, task.expected_seconds())
            }
        };
        (done, (1.0 - done) * seconds)
    }

    /// Starts again, because the stored slices cannot be used.
    pub(crate) fn begin_again(&mut self) {
        self.done = 0;
        if let SlicedTask::Evolution { task, state } = &mut self.task {
            *state = Some(task.begin());
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
        let sliced = |stored: &[SliceRecord]| SlicedWork::case(checked.clone(), cuts(), stored);
        let good = [note(0, 3, &checked), note(1, 5, &checked)];
        let going = sliced(&good);
        assert_eq!((going.done, going.spent), (2, Duration::from_secs(5)));
        assert!((going.progress().0 - 1.0).abs() < f64::EPSILON);
        assert_eq!(sliced(&[]).done, 0);
        // Cut elsewhere, a hole, another solver.
        assert_eq!(sliced(&[note(0, 2, &checked)]).done, 0);
        assert_eq!(sliced(&good[1..]).done, 0);
        let other = SliceRecord {
            digest: "of another revision".to_owned(),
            ..good[1].clone()
        };
        let half = sliced(&[good[0].clone(), other]);
        assert_eq!((half.done, half.spent), (1, Duration::from_secs(3)));
    }
}
