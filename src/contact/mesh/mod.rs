//! Strips along rolling and their cells.

pub mod observation;
#[cfg(test)]
pub(crate) mod samples;
pub mod size;
pub mod strips;
