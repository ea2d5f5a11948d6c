//! The fast solver: projection form, semismooth Newton, strip-preconditioned GMRES.

pub mod gmres;
pub mod newton;
pub mod strip_blocks;
