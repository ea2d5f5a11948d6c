//! The boundary element method: semismooth Newton iteration on strips.

pub mod linearisation;
pub mod newton;
pub mod preconditioner;
mod rule_sequence;
pub mod solve;
mod strip_blocks;
pub mod task;
pub mod workspace;
