//! Connections: accepting, counting, time limits and closing.

pub mod connection;
pub mod drain_body;
pub mod listener;
pub mod places;
pub mod unread;
pub mod write_timeout;
