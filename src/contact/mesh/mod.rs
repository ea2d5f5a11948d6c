//! Strips along the rolling direction, divided into cells.

#[cfg(test)]
pub(crate) mod samples;
pub mod strips;
