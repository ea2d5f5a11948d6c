//! Semismooth Newton iteration on strips.

pub mod newton;
pub mod preconditioner;
pub mod solve;
