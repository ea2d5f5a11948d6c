//! Methods that solve one motion on one mesh.

pub mod boundary_element;
pub mod fastsim;
pub mod liu_hsu;
pub mod table;
