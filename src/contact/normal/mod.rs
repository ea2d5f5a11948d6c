//! The normal problem: which patches touch, and with what pressure.

pub(crate) mod contact_planes;
pub(crate) mod curve_grid;
pub mod footprint;
pub mod gap;
pub mod hertz;
pub(crate) mod on_curve;
pub mod pressure_field;
pub mod wheel;
