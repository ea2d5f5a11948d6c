//! The stored forms of solutions and fields.

pub mod encode;
pub mod fields;
pub mod result;
