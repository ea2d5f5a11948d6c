//! The body of a batch: cut into cases while it arrives, an array, lines or a table.

pub mod body;
pub mod own_options;
pub mod splitter;
pub mod table;
