//! The tangential problem: which tractions, slips and forces belong to a motion on a given footprint.
//!
//! | question | where |
//! |---|---|
//! | what is asked | [`task`] |
//! | which creepages give a prescribed force | [`force_control`] |
//! | on which meshes, until when | [`refinement`] |
//! | how one mesh is solved | [`methods`] |
//! | which equations they solve | [`slip_equations`], [`slip_rules`] |
//! | mesh, pressures and bounds of one level | [`strip_mesh`] |
//! | operators kept for later cases | [`operator_store`] |
//! | rolling that changes, step by step | [`history`], with [`displacement_memory`] |
//! | what comes out | [`answer`] |
//! | closed forms | [`linear_theory`], [`load_ellipse`] |

pub mod answer;
pub mod displacement_memory;
pub mod force_control;
pub mod history;
pub mod linear_theory;
pub mod load_ellipse;
pub mod methods;
pub mod operator_store;
pub mod refinement;
pub mod slip_equations;
pub mod slip_rules;
pub mod strip_mesh;
pub mod task;
