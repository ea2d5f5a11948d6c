//! Many jobs submitted, followed and read as one.

pub mod abandon;
pub mod control;
pub mod fill;
pub mod results;
pub mod staging;
pub mod template;
pub mod upload;
