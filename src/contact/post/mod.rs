//! Quantities derived from stored cell values: zones, outlines, samples on a grid.

pub mod outlines;
pub mod resample;
pub mod smooth;
pub mod strip_segments;
