//! Laws of friction: the largest traction of a cell.

pub mod coefficient_table;
pub mod law;
pub mod path_dependent;
pub mod velocity_weakening;
