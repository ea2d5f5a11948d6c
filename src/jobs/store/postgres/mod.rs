//! The shared job table: PostgreSQL 15 or later.
//!
//! The statements are those of the embedded table. Locks replace its single writer: claims lock their rows and skip those
//! that others have locked, and an advisory lock protects the places in the queue. Counters are stored as differences,
//! which need no lock. Only the clock of the database decides when a lease has expired.

#[macro_use]
mod tokens;

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
