//! Many jobs submitted, followed and read as one.

pub mod control;
pub mod upload;
