//! The shape of a patch from its cells: outlines of patch and zones, values on a regular grid, and a curved grid for pictures.
//!
//! `benches/figures` compiles this folder too. It therefore uses only `railhead_contact` and its own files.

mod monotone;
pub(crate) mod outlines;
pub(crate) mod resample;
pub(crate) mod sheet;
