//! Semismooth Newton iteration on strips.

mod falling_rows;
pub mod fixed_point;
pub mod linearisation;
pub mod newton;
mod newton_system;
pub mod preconditioner;
mod rule_sequence;
pub mod solve;
mod strip_blocks;
pub mod task;
pub mod workspace;
