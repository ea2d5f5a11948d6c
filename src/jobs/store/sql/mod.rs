//! The statements of a job table: one text for every database.
//!
//! These files are compiled once for each database, below its folder. There, `engine` says what its types are called and how a
//! transaction begins, and `tokens` the few words that databases spell differently. What makes it a rule of its own: PostgreSQL
//! reads each statement of a transaction as of its own time, so that a change says itself which state it starts from
//! (`WHERE state = 'running' AND lease_token = …`), or takes rows that were locked before. Integers are 64 bits and flags are 0
//! or 1, because both databases have these.

use super::engine;

pub mod batch_lists;
mod batches;
pub mod blob_refs;
pub mod blobs;
pub mod cached;
pub mod claim;
pub mod enqueue;
pub mod finish;
pub mod group_commit;
pub mod insert;
pub mod jobs;
pub mod keys;
pub mod lease;
pub mod lists;
mod profiles;
pub mod quota;
pub mod rows;
pub mod slices;
pub mod stats;
pub mod store;
pub mod upkeep;
