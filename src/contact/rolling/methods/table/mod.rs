//! Creep forces of an elliptic patch from a table that the boundary-element solver made.

pub mod evaluate;
pub mod file;
pub mod shape_coefficients;
pub mod solve;
pub mod spline;
