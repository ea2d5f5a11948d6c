//! The shape of a patch from its cells: outlines of patch and zones, values on a regular grid, and a smooth sheet for pictures.
//!
//! `benches/figures` compiles this folder too, so that it names only `railhead_contact` and its own files.

mod monotone;
pub(crate) mod outlines;
pub(crate) mod resample;
pub(crate) mod sheet;
