//! The checked question: physics, run and label, as numbers. Every stage after the check takes its task from here.

pub mod checked_case;
pub mod memory;
pub mod physics;
