//! The members of a case: names, units, ranges, and how they are read with all faults of the text.

pub mod contact;
pub mod cross_section;
pub mod evolution;
pub mod friction;
pub mod material;
pub mod motion;
pub(crate) mod object;
pub(crate) mod samples;
pub mod solver;
pub mod subsurface;
