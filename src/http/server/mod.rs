//! Connections: accepted, counted, kept in time, and let go.

pub mod connection;
pub mod drain_body;
pub mod listener;
pub mod places;
pub mod write_timeout;
