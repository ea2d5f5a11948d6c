//! Every failure that a client can see: its kinds, their meanings, and the way from an error to an answer.

pub mod catalogue;
pub mod error;
pub mod kinds;
