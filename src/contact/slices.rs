//! Cuts long sweeps into slices of about equal numbers of motions. Each slice is solved alone, and the answers are joined.
//!
//! No start is carried over a cut, so that an answer does not depend on when and where its slices were solved, or whether a restart came
//! between: [`solve`](crate::solve) takes the same slices one after the other.

use std::ops::Range;

use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::merged;
use crate::rolling::task::Resolution;
use crate::solution::words::answer::{Fields, Solution};

/// Most motions of a slice. Few motions keep the time short that other jobs wait; each slice finds region and pressure again. Chosen by judgement.
const MOTIONS_MAX: usize = 100;
/// The same where a motion takes long: unlike bodies, whose motions each have a pressure of their own, and fine meshes.
const MOTIONS_MAX_LONG: usize = 10;
/// Targets below this one need fine meshes.
const TARGET_FINE: f64 = 0.002;
/// An explicit mesh is fine from this number of cells on.
const CELLS_FINE: u32 = 1000;

/// Where a case is cut: ranges of motions in order, one after the other, at least one. The same case gives the same slices, whatever the
/// load, limits and machine.
pub fn slices(case: &CheckedCase) -> Vec<Range<usize>> {
    let motions = case.problem.motions.len();
    // The points of a history follow from each other, and one motion is not cut.
    if case.problem.history.is_some() || motions == 1 {
        return std::iter::once(0..motions).collect();
    }
    // Nearly equal parts, so that no short one is left over.
    let is_fine = match case.run.least_resolution() {
        Resolution::Target(target) => target < TARGET_FINE,
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

impl Solution {
    /// Puts the motions of the next slice behind those of this one; both are of one case.
    pub fn append(&mut self, later: Solution) {
        debug_assert_eq!(self.patches.len(), later.patches.len());
        for (patch, more) in self.patches.iter_mut().zip(later.patches) {
            patch.points.extend(more.points);
        }
        self.total.extend(later.total);
        // What is said of the whole case is said by every slice.
        let remarks = std::mem::take(&mut self.remarks);
        self.remarks = merged(remarks.into_iter().chain(later.remarks));
    }
}

impl Fields {
    /// The same for values per cell.
    pub fn append(&mut self, later: Fields) {
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
