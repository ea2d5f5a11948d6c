//! What stands around every request; one layer is one file. `mod.rs` of the room says in which order.

pub mod admission;
pub mod auth;
pub mod catch_panic;
pub mod compression;
pub mod cors;
pub mod etag;
pub mod final_newline;
pub mod metrics;
pub mod origin_guard;
pub mod otel;
pub mod process_metrics;
pub mod rate_limit;
pub mod request_id;
pub mod request_log;
pub mod security_headers;
