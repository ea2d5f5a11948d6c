//! A checked case as numbers, from which every later stage takes its input.

pub mod checked_case;
pub mod memory;
pub mod physics;
