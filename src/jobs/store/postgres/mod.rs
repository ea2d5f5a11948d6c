//! The job table that several processes share: PostgreSQL 15 or later.
//!
//! The statements are those of the embedded table. What a single writer gives there is asked for here: claims lock their rows
//! and pass by those that others have locked, who takes places in the queue does so alone, counts are kept as differences that
//! nobody waits for, and only the clock of the database decides when a lease has run out.

#[macro_use]
mod tokens;

pub(crate) mod answer;
mod claim_memory;
pub mod cluster;
pub mod connection;
pub mod database;
pub mod doctor;
pub mod engine;
mod import;
pub mod notifier;
pub mod objects;
pub mod schema;
#[path = "../sql/mod.rs"]
#[expect(
    clippy::duplicate_mod,
    reason = "the shared statements are compiled once for each database"
)]
pub mod sql;
pub(crate) mod url;
