//! The normal problem: which patches touch, and with what pressure.

pub mod answer;
pub mod footprint;
pub mod gap;
pub mod hertz;
pub mod neighbours;
pub mod patch;
pub mod pressure_field;
pub mod region;
pub mod wheel_height;
