//! Adaptive refinement: a motion is solved on nested meshes, coarse to fine, until the estimated error meets the target.
//!
//! | question | where |
//! |---|---|
//! | which meshes, when to stop | [`adapt`] |
//! | sizes and grading of the meshes of a motion | [`mesh_family`] |
//! | one mesh: first iterate, method, resultants | [`on_mesh`] |
//! | error and extrapolated value | [`error_estimate`] |
//! | first iterates from earlier motions and from coarser meshes; meshes kept from motion to motion | [`predictor`], [`interpolate`] |
//! | derivatives by creepages and spin | [`gradients`] |

pub mod adapt;
pub mod error_estimate;
pub mod gradients;
pub mod interpolate;
pub mod mesh_family;
pub mod on_mesh;
pub mod predictor;
