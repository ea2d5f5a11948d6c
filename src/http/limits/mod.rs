//! What all requests together, and those of one tenant, may use: memory, turns to compute, requests, streams and waits in progress.

pub mod concurrency;
pub mod holding_body;
pub mod memory;
pub mod shares;
