//! Resources that describe the service itself.

pub mod examples;
pub mod health;
pub mod methods;
pub mod metrics;
pub mod problems;
pub mod remarks;
