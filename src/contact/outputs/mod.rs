//! What is derived from stored cell values: outlines of the zones, fields on a regular grid.
//!
//! Pure functions of [`PatchFields`](crate::contact::solution::PatchFields); nothing here solves anything.

pub mod assemble;
mod loops;
pub mod outline;
pub mod resample;
pub mod resultants;
mod segments;
pub mod track;
