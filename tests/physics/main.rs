//! Does the physics hold?

mod carter;
mod case_faults;
mod case_mutations;
mod cases;
mod hertz;
mod kalker;
mod laws;
mod problem;
mod reference;
mod reference_hertz;
mod robustness;
