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
}
