//! railhead: a rolling-contact stress service.

pub mod contact;
pub mod jobs;
