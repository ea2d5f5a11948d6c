//! Does the physics hold?

mod case_faults;
mod case_mutations;
mod cases;
mod hertz;
mod pressure_grid;
mod pressure_grid_faults;
mod pressure_grid_shapes;
mod pressure_samples;
mod problem;
