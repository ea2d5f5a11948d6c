//! The words of this room: jobs, batches, keys, kinds and options as types that need no store and no worker. Every other folder may use them.

pub mod batch;
pub mod job;
pub mod key;
pub mod kind;
pub mod labels;
pub mod submit_options;
