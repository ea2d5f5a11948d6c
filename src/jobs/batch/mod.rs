//! Batches: many jobs that are submitted, followed and read together.

pub mod control;
pub mod upload;
