//! Stresses below the surface: tensors at chosen points, and the worst point of a patch.

pub mod lines;
pub mod load_parts;
pub mod principal;
pub mod states;
pub mod surface_load;
pub mod task;
pub mod worst;
