//! Does the physics hold?

mod carter;
mod case_faults;
mod case_mutations;
mod cases;
mod convergence_domain;
mod equations;
mod friction;
mod gap_faults;
mod gap_hertz;
mod gap_reference;
mod gap_samples;
mod golden;
mod hertz;
mod kalker;
mod laws;
mod liu_hsu;
mod liu_hsu_newton;
mod pressure_grid;
mod pressure_grid_faults;
mod pressure_grid_shapes;
mod pressure_samples;
mod problem;
mod reference;
mod reference_hertz;
mod regions;
mod robustness;
