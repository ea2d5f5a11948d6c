//! The law of friction: how large a traction can become.

pub mod coefficient_table;
pub mod law;
pub mod path_dependent;
pub mod velocity_weakening;
