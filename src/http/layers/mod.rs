//! What stands around every request; one layer is one file. `mod.rs` of the room says in which order.

pub(super) mod admission;
pub(super) mod auth;
pub(super) mod client_address;
pub(super) mod etag;
pub(super) mod metrics;
#[cfg(feature = "otlp")]
pub(super) mod otel;
pub(super) mod request_log;
pub(super) mod response;
