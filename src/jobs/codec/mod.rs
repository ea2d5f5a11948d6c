//! Stored forms of solutions and fields.

pub mod fields;
pub mod result;
