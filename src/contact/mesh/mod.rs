//! Strips along rolling and their cells.

pub mod observation;
pub mod size;
pub mod strips;
