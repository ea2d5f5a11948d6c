//! Region and pressure of a given gap.

pub mod conjugate_gradients;
pub mod grid;
pub mod outcome;
pub mod patch_grids;
pub mod solve;
pub mod surface;
pub mod task;
