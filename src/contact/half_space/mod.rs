//! The elastic half-space: surface displacements caused by pressures and tractions.

pub mod bent_surface;
pub mod elasticity;
pub mod grid_operator;
pub mod kernels;
pub mod line_sums;
pub mod point_loads;
#[cfg(test)]
pub mod rectangle_stress;
pub mod strip_operator;
pub mod transforms;
pub mod unlike_bodies;
