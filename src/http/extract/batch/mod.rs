//! The body of a batch: cut into cases while it arrives, an array, lines or a table.

pub mod body;
pub mod splitter;
pub mod table;
