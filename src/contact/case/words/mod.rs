//! The words of a case: their names, units and ranges, and how they are read with every fault of the text.

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
