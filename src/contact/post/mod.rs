//! Quantities derived from cell values: friction power, outlines, samples on a grid, stresses below the surface, damage, temperatures.

pub mod damage;
pub mod local_power;
pub mod outlines;
pub mod resample;
pub mod smooth;
pub mod subsurface;
