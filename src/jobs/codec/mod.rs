//! The stored forms of solutions and fields.

pub mod arrow;
pub mod encode;
pub mod fields;
pub mod parquet;
pub mod result;
pub mod table;
