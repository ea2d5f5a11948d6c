//! Pressures on a grid of samples: given by the client, or computed from a gap.

pub mod field;
pub mod given;
pub mod grid_pressure;
pub mod level_set;
