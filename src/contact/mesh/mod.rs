//! Strips along rolling and their cells.

pub mod strips;
