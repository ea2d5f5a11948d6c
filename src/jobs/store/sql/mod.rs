//! The shared statements of a job table.
//!
//! These files are compiled once for each database, as a module of its folder. There, `engine` defines types and
//! transactions, and `tokens` the few words that differ. PostgreSQL evaluates each statement of a transaction with a new
//! snapshot, so that an update names the state it starts from (`WHERE state = 'running' AND lease_token = …`), or its rows
//! were locked before. Integers are 64 bits and flags are 0 or 1, because both databases support these.

use super::engine;

pub mod batches;
pub mod blobs;
pub mod claim;
pub mod finish;
pub mod jobs;
pub mod keys;
pub mod rows;
pub mod submit;
pub mod upkeep;
