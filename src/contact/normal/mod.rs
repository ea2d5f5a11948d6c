//! The normal problem: which patches touch, and with what pressure.

pub(crate) mod axis_ratio;
pub(crate) mod contact_planes;
pub(crate) mod curve_grid;
pub mod footprint;
pub mod gap;
pub mod hertz;
pub mod load_across;
pub mod normal_task;
pub(crate) mod on_curve;
pub mod patch;
pub mod pressure_field;
pub mod surface_slip;
pub mod wheel;
