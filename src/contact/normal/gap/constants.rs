//! Tuned numbers of the gap solver: how fine its grids are, and when they are fine enough.

use crate::contact::normal::gap::grid::GridFineness;

/// Cells of the first grid along either axis.
pub(crate) const CELLS_FIRST: usize = 32;

/// How fine the last grid is at least.
pub(crate) const RESOLUTION: GridFineness = GridFineness {
    contact: 44.0,
    patch: 24.0,
    share_min: 0.02,
};

/// The same where only forces are asked for, to some tenths of a per cent.
pub(crate) const RESOLUTION_COARSE: GridFineness = GridFineness {
    contact: 22.0,
    patch: 12.0,
    share_min: 0.05,
};

/// Below this target of the resultants' error (relative to μN) grids are finer: the error of a normal problem falls with the
/// power 3/2 of its cells' size.
pub(crate) const TARGET_USUAL: f64 = 0.002;

pub(crate) const TARGET_POWER: f64 = -2.0 / 3.0;

/// A grid with cells larger than wanted by less than this factor (inverse) will do.
pub(crate) const COARSER_MAX: f64 = 0.8;

/// A rough gap is looked at more closely until neither the approach nor the largest pressure change by more than this,
/// times the ratio of the cells' sizes.
pub(crate) const APPROACH_CHANGE: f64 = 0.002;

pub(crate) const PRESSURE_CHANGE: f64 = 0.015;

/// How much finer the next grid is.
pub(crate) const REFINEMENT: f64 = 1.6;

/// Violation of the contact conditions relative to the deepest overlap, on the first grid and on the others.
pub(crate) const TOLERANCE_FIRST: f64 = 2e-3;

pub(crate) const TOLERANCE: f64 = 2e-4;

/// Grids tried; each is larger, shifted or finer than the one before.
pub(crate) const GRIDS_MAX: usize = 12;

/// Cells outside the contact that nearly touch, relative to the deepest overlap, belong to the next grid.
pub(crate) const NEAR: f64 = 0.03;
