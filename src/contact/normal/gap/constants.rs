//! Tuned numbers of the gap solver: how fine its grids are, and when they are fine enough.
//!
//! Errors at these numbers are those of `tests/physics/gap_hertz.rs` and `gap_reference.rs`; `cargo bench --bench gaps` prints times and
//! errors of the reference gaps. Where no sensitivity is given it was not measured.

use crate::contact::normal::gap::grid::GridFineness;

/// Fewest cells across the contact, and across every patch with the given share of the load, on the last grid: with 44 cells the error of
/// the resultants is below 0.0007 in nine of ten gaps (see `REGION` of the rolling constants).
pub(crate) const RESOLUTION: GridFineness = GridFineness {
    first: 32,
    contact: 44.0,
    patch: 24.0,
    share_min: 0.02,
    settles: true,
    tolerance: 2e-4,
};

/// Below this target of the resultants' error (relative to μN) grids are finer: the error of a normal problem falls with the
/// power 3/2 of its cells' size.
pub(crate) const TARGET_USUAL: f64 = 0.002;

/// Power of the target over [`TARGET_USUAL`] by which the cells grow: the inverse of that 3/2.
pub(crate) const TARGET_POWER: f64 = -2.0 / 3.0;

/// Between these targets patches have fewer cells, the looser the target: that of a case that gives none still has all.
pub(crate) const TARGETS_LOOSE: [f64; 2] = [0.005, 0.02];

/// Power of the target by which they fall: 25 cells at 0.02. At that target gaps take two thirds of the time that they
/// take with all cells; .97 and .95 of them are covered, .985 and .99 with all cells
/// (`cargo bench --bench calibrate gap profiles`).
pub(crate) const LOOSE_POWER: f64 = -0.4;

/// A grid is fine enough if the cells that are wanted are no smaller than this times its own.
pub(crate) const COARSER_MAX: f64 = 0.8;

/// A gap is solved on finer grids until the approach changes by no more than this, relative to the depth of overlap and times the ratio
/// of the cells' sizes.
pub(crate) const APPROACH_CHANGE: f64 = 0.002;

/// The same for the largest pressure.
pub(crate) const PRESSURE_CHANGE: f64 = 0.015;

/// Ratio of the cells along an axis from one such grid to the next.
pub(crate) const REFINEMENT: f64 = 1.6;

/// Violation of the contact conditions relative to the deepest overlap that ends the iteration on the first grid, which only finds the
/// box.
pub(crate) const TOLERANCE_FIRST: f64 = 2e-3;

/// Most grids that are tried; each is larger, shifted or finer than the one before. Numeric safety.
pub(crate) const GRIDS_MAX: usize = 12;

/// Where the approach found is beyond the level that a box was made for, the next box is made for the approach and this part of the depth of
/// overlap more. Chosen by judgement; the box grows again where it is not enough.
pub(crate) const LEVEL_BEYOND: f64 = 0.2;

/// Cells outside the contact that nearly touch, relative to the deepest overlap, belong to the next grid.
pub(crate) const NEAR: f64 = 0.03;
