//! Every failure that a client can see: its kinds, their meanings, and the way from an error to an answer.

pub(super) mod body;
pub(super) mod catalogue;
pub(super) mod error;
pub(super) mod kinds;
