//! The law of friction: how large a traction can become.

pub mod law;
