//! The words of this room: jobs, batches, keys, lanes and options as types that need no store and no worker. Every other folder may use them.

pub mod batch;
pub mod job;
pub mod key;
pub mod labels;
pub mod lane;
pub mod submit_options;
