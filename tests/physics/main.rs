//! Does the physics hold?

mod case_faults;
mod case_mutations;
mod cases;
mod hertz;
mod problem;
