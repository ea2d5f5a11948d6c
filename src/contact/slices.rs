//! Divides long sweeps into slices of about equal numbers of motions. Each slice is solved separately, and the answers are joined.
//!
//! A slice does not use start values of another one, so that an answer does not depend on when and where its slices are solved.
//! [`solve`](crate::solve) solves the same slices one after the other.

use std::ops::Range;

use crate::half_space::strip_operator::kind::Precision;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::merged;
use crate::rolling::task::Resolution;
use crate::solution::words::answer::{Fields, Solution};

/// Maximum number of motions of a slice. Short slices let other jobs start soon, but each slice solves the normal problem again. Chosen by
/// judgement.
const MOTIONS_MAX: usize = 100;
/// Maximum number of slow motions of a slice: those on fine meshes, and those of unlike bodies, which each have a separate pressure.
const MOTIONS_MAX_LONG: usize = 10;
/// Smallest number of cells of a fine explicit mesh.
const CELLS_FINE: u32 = 1000;

/// Returns the slices of a case: consecutive ranges of motions, at least one. They depend on the case alone.
pub fn slices(case: &CheckedCase) -> Vec<Range<usize>> {
    let motions = case.problem.motions.len();
    // A history is not divided, because its points depend on each other.
    if case.problem.history.is_some() || motions == 1 {
        return std::iter::once(0..motions).collect();
    }
    let resolution = case.run.least_resolution();
    let is_fine = match resolution {
        Resolution::Target(_) => resolution.precision() == Precision::Double,
        Resolution::Mesh(size) => size.strips * size.cells >= CELLS_FINE,
    };
    let most = match is_fine || case.problem.is_coupled(&case.run) {
        true => MOTIONS_MAX_LONG,
        false => MOTIONS_MAX,
    };
    let parts = motions.div_ceil(most).max(1);
    let start = |part: usize| part * motions / parts;
    (0..parts)
        .map(|part| start(part)..start(part + 1))
        .collect()
}

/// Joins the answers to consecutive motions of a case, of which there is at least one. It ends at the first error.
///
/// # Errors
/// The first error among the answers.
pub fn joined<E>(
    answers: impl IntoIterator<Item = Result<(Solution, Fields), E>>,
) -> Result<(Solution, Fields), E> {
    let mut answers = answers.into_iter();
    let Some(first) = answers.next() else {
        unreachable!("a case has at least one motion")
    };
    let (mut solution, mut fields) = first?;
    for later in answers {
        let (more, more_fields) = later?;
        solution.append(more);
        fields.append(more_fields);
    }
    Ok((solution, fields))
}

/// Adds the patches of one part of a contact to those of the parts before it. Totals and remarks stay those of the first part.
pub(crate) fn add_patches(
    whole: &mut Option<(Solution, Fields)>,
    (solution, fields): (Solution, Fields),
) {
    let Some((all, all_fields)) = whole else {
        *whole = Some((solution, fields));
        return;
    };
    all.normal = all.normal.zip(solution.normal).map(|(a, b)| a.with(b));
    all.patches.extend(solution.patches);
    all_fields.patches.extend(fields.patches);
}

impl Solution {
    /// Appends the motions of the next slice of the same case.
    fn append(&mut self, later: Solution) {
        debug_assert_eq!(self.patches.len(), later.patches.len());
        for (patch, more) in self.patches.iter_mut().zip(later.patches) {
            patch.points.extend(more.points);
        }
        self.total.extend(later.total);
        // Every slice has the remarks on the whole case.
        let remarks = std::mem::take(&mut self.remarks);
        self.remarks = merged(remarks.into_iter().chain(later.remarks));
    }
}

impl Fields {
    /// Appends the values per cell of the next slice of the same case.
    fn append(&mut self, later: Fields) {
        debug_assert_eq!(self.patches.len(), later.patches.len());
        for (patch, mut more) in self.patches.iter_mut().zip(later.patches) {
            let meshes = patch.meshes.len();
            more.points
                .iter_mut()
                .for_each(|point| point.mesh += meshes);
            patch.meshes.extend(more.meshes);
            patch.points.extend(more.points);
        }
    }
}
