//! The tangential problem of steady rolling.

pub mod answer;
pub mod cubic_law;
pub mod displacement_memory;
pub mod force_control;
pub mod force_places;
pub mod history;
pub(crate) mod layer_slip;
pub mod linear_theory;
pub mod load_ellipse;
pub mod mesh_plan;
pub mod methods;
pub mod motion;
pub mod motion_answer;
pub mod operator_store;
pub mod own_blocks;
pub mod refinement;
pub mod resolution;
pub mod resultants;
pub mod skip;
pub mod slip_equations;
pub mod slip_rules;
pub mod start;
pub mod strip_chords;
pub mod strip_mesh;
pub mod task;
pub mod vortex;
