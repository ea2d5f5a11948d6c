//! What stands around every request; one layer is one file. `mod.rs` of the room says in which order.

pub(super) mod admission;
pub(super) mod auth;
pub(super) mod catch_panic;
pub(super) mod client_address;
pub(super) mod compression;
pub(super) mod cors;
pub(super) mod etag;
pub(super) mod final_newline;
pub(super) mod metrics;
pub(super) mod origin_guard;
#[cfg(feature = "otlp")]
pub(super) mod otel;
pub(super) mod process_metrics;
pub(super) mod rate_limit;
pub(super) mod request_id;
pub(super) mod request_log;
pub(super) mod security_headers;
