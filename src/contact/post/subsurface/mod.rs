//! Stresses below the surface: tensors at chosen points, the worst point of a patch, and the effect of a passage of the contact.

pub mod load_parts;
pub(crate) mod loaded_run;
pub mod states;
pub mod surface_load;
pub mod worst;
pub mod worst_passage;
