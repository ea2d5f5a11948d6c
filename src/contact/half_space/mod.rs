//! The elastic half-space: surface displacements caused by pressures and tractions.

pub mod elasticity;
pub mod grid_coefficients;
pub mod grid_operator;
pub mod kernels;
pub mod strip_operator;
pub mod transforms;
