//! The elastic half-space: influence of tractions and pressures on displacements.

pub mod elasticity;
pub mod grid_coefficients;
pub mod grid_operator;
pub mod kernels;
pub mod strip_operator;
pub mod transforms;
