//! The words of a case: units in the names, no arithmetic.

pub mod contact;
pub mod evolution;
pub mod motion;
pub mod solver;
pub mod subsurface;
