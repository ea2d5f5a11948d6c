//! Extractors, which read requests strictly: caller, ids, query, body, and the formats that the client accepts.

pub mod accept;
pub mod batch;
pub mod caller;
pub mod json;
pub mod query;
pub mod rows;
