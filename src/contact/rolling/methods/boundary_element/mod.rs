//! Semismooth Newton iteration on strips.

pub mod fixed_point;
pub mod linearisation;
pub mod newton;
pub mod preconditioner;
pub mod solve;
pub mod task;
pub mod workspace;
