//! Damage models: what one pass of a solved contact does to the surface.

pub mod evaluate;
pub mod figures;
pub mod models;
