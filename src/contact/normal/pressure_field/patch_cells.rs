//! One patch of a grid, with the range of its cells.

use std::ops::RangeInclusive;

use crate::contact::normal::patch::Patch;

/// One patch and the cells it may occupy.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PatchShape {
    pub(crate) patch: Patch,
    pub(crate) columns: RangeInclusive<usize>,
    pub(crate) rows: RangeInclusive<usize>,
    pub(crate) segments_per_strip: f64,
    pub(crate) load: SampledLoad,
}

/// The load of some samples: the sum of their pressures relative to the largest one, times the areas they represent in mm², and their mean position
/// `[x, y]` in mm, weighted so.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SampledLoad {
    pub(crate) weight: f64,
    pub(crate) centre: [f64; 2],
}
