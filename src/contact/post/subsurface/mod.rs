//! Stresses below the surface: tensors at chosen points, the worst point of a patch, and what a passage of the contact does.

pub mod load_parts;
pub(crate) mod loaded_run;
pub mod states;
pub mod surface_load;
pub mod worst;
pub mod worst_passage;
