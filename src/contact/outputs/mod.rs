//! What is derived from stored cell values: outlines of the zones, fields on a regular grid.
//!
//! Pure functions of [`PatchCells`](crate::contact::solution::PatchCells); nothing here solves anything.

pub mod assemble;
pub mod finish;
pub mod finite;
mod loops;
pub mod outline;
pub mod resample;
pub mod resultants;
mod segments;
pub mod track;
