//! What requests may take together and of one tenant: memory, turns to compute, requests, streams and waits under way.

pub mod concurrency;
pub mod holding_body;
pub mod memory;
pub mod shares;
