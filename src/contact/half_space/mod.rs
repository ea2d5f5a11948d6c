//! The elastic half-space: surface displacements caused by pressures and tractions.

pub mod corner_sums;
pub mod elasticity;
pub mod grid_coefficients;
pub mod grid_operator;
pub mod kernels;
pub mod rectangle_stress;
pub mod strip_operator;
pub mod transforms;
pub mod unlike_bodies;
