//! Region and pressure of a given gap.

pub mod answer;
pub mod asperities;
pub mod cell_sums;
pub mod conjugate_gradients;
pub mod constants;
pub mod coupling;
pub mod edges;
pub mod grid;
pub mod near_cells;
pub mod outcome;
pub mod patch_grid;
pub mod patch_grid_influence;
pub mod patch_grids;
pub mod preview;
pub mod search_box;
pub mod solve;
pub mod surface;
pub mod task;
