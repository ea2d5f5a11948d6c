//! Resources that describe the service itself.

pub(crate) mod examples;
pub(crate) mod health;
pub(crate) mod methods;
pub(crate) mod metrics;
pub(crate) mod problems;
pub(crate) mod remarks;
