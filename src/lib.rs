//! railhead: a rolling-contact stress service.

pub mod contact;
pub mod http;
pub mod jobs;
