//! The job table on one machine, embedded: SQLite.

#[macro_use]
mod tokens;

pub(crate) mod connection;
pub mod database;
pub mod engine;
#[cfg(feature = "cluster")]
mod export;
#[cfg(test)]
mod plans;
pub mod schema;
#[path = "../sql/mod.rs"]
pub mod sql;
