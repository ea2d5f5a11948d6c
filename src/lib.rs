//! railhead: a rolling-contact stress service.

pub mod cli;
pub mod contact;
pub mod http;
pub mod jobs;
pub mod telemetry;
