//! A motion on nested meshes, coarse to fine, until the estimate of the error meets the target.
//!
//! | question | where |
//! |---|---|
//! | which meshes, when to stop | [`adapt`] |
//! | sizes and grading of the meshes of a motion | [`mesh_family`] |
//! | one mesh: start, method, resultants | [`on_mesh`] |
//! | error and extrapolated value | [`error_estimate`] |
//! | starts from motions before and from coarser meshes | [`predictor`], [`interpolate`] |
//! | derivatives by creepages and spin | [`gradients`] |
//! | meshes kept from one motion to the next | [`levels`], [`state`] |

pub mod adapt;
pub mod error_estimate;
pub mod gradients;
pub mod interpolate;
pub mod mesh_family;
pub mod on_mesh;
pub mod predictor;
