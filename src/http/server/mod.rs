//! Connections: accepting, counting, time limits and closing.

pub(super) mod connection;
pub(super) mod drain_body;
pub(super) mod listener;
pub(super) mod places;
pub(super) mod unread;
pub(super) mod write_timeout;
