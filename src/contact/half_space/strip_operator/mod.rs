//! Differences of displacement along strips, by tractions of their cells.

pub mod assembly;
pub mod kind;
pub mod operator;
pub mod product;
