//! The statements of a job table: one text for every database.
//!
//! These files are compiled once for each database, below its folder. There, `engine` says what its types are called and how a
//! transaction begins, and `tokens` the few words that databases spell differently. What makes it a rule of its own: PostgreSQL
//! reads each statement of a transaction as of its own time, so that a change says itself which state it starts from
//! (`WHERE state = 'running' AND lease_token = …`), or takes rows that were locked before. Integers are 64 bits and flags are 0
//! or 1, because both databases have these.

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
