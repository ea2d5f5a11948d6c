//! Quantities derived from cell values: friction power, stresses below the surface, damage, temperatures.

pub mod damage;
pub mod local_power;
pub mod subsurface;
