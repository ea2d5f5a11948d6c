//! Creep forces of an elliptic patch from a table computed with the boundary element method.

pub mod evaluate;
pub mod file;
pub mod solve;
pub mod spline;
