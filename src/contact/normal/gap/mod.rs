//! Region and pressure of a given gap.

pub mod answer;
pub mod cell_sums;
pub mod conjugate_gradients;
pub mod constants;
pub mod coupling;
pub mod edges;
pub mod grid;
pub mod near_cells;
pub mod outcome;
pub mod pilot;
pub mod pilot_solve;
pub mod search_box;
pub mod seen;
pub mod solve;
pub mod solve_from;
pub mod start;
pub mod summits;
pub mod surface;
pub mod task;
pub mod tile;
pub mod tiles;
pub mod tiles_influence;
