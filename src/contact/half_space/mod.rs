//! The elastic half-space: surface displacements caused by pressures and tractions.

pub mod bent_surface;
pub mod kernels;
pub mod strip_operator;
pub mod unlike_bodies;
