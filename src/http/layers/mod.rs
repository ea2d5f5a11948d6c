//! Layers around the routes, one per file. `lib.rs` lists their order.

pub(super) mod admission;
pub(super) mod auth;
pub(super) mod client_address;
pub(super) mod etag;
pub(super) mod metrics;
#[cfg(feature = "otlp")]
pub(super) mod otel;
pub(super) mod request_log;
pub(super) mod response;
