//! Strips along the rolling direction, divided into cells.

pub mod chord;
pub mod observation;
#[cfg(test)]
pub(crate) mod samples;
pub mod size;
pub mod strips;
