//! The tangential problem of steady rolling.

pub mod answer;
pub mod force_control;
pub mod linear_theory;
pub mod methods;
pub mod operator_store;
pub mod refinement;
pub mod regime;
pub mod resultants;
pub mod slip_equations;
pub mod slip_rules;
pub mod strip_chords;
pub mod strip_mesh;
pub mod vortex;
