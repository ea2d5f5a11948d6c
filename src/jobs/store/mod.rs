//! What a job table must promise. One database is one folder here.

pub mod list;
pub mod sqlite;
pub mod types;
