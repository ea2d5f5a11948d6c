//! Pressures on a grid of samples: given by the client, or computed from a gap.

pub mod components;
pub mod computed;
pub mod field;
pub mod given;
pub mod grid_pressure;
pub mod jump;
pub mod jumps;
pub mod level_set;
pub mod line;
pub mod moments;
pub mod patch_cells;
pub mod patch_shape;
pub mod sample_grid;
