//! A motion on nested meshes, coarse to fine, until the estimate of the error meets the target.
//!
//! | question | where |
//! |---|---|
//! | which meshes, when to stop | [`adapt`] |
//! | sizes and grading of the meshes of a motion | [`mesh_family`] |
//! | one mesh: start, method, resultants | [`on_mesh`] |
//! | error and extrapolated value | [`error_estimate`] |
//! | starts from motions before and from coarser meshes; meshes kept from one motion to the next | [`predictor`], [`interpolate`] |
//! | derivatives by creepages and spin | [`gradients`] |

pub mod adapt;
pub mod error_estimate;
pub mod gradients;
pub mod interpolate;
pub mod mesh_family;
pub mod on_mesh;
pub mod predictor;
