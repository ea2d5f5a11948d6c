//! What all requests together, and those of one tenant, may use: memory, turns to compute, requests, streams and waits in progress.

pub(super) mod concurrency;
pub(super) mod holding_body;
pub(super) mod memory;
pub(super) mod tenant_semaphore;
pub(super) mod turns;
