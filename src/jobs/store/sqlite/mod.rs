//! The job table on one machine, embedded: SQLite.

mod batch_lists;
mod batches;
pub mod blob_refs;
pub mod blobs;
pub mod cached;
pub mod calls;
pub mod claim;
pub mod database;
pub mod deadlines;
pub mod enqueue;
pub mod errors;
pub mod expire;
pub mod finish;
pub mod group_commit;
pub mod insert;
pub mod jobs;
pub mod keys;
pub mod lease;
pub mod lists;
pub mod quota;
pub mod reap;
pub mod rows;
pub mod schema;
pub mod slices;
pub mod stats;
