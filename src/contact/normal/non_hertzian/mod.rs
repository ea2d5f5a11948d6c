//! Any gap: contact region and pressure under a load or an approach.

mod edges;
pub mod gap;
mod gradients;
mod trial;
