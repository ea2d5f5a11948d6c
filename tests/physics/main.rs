//! Tests of the physics.

#[path = "../../benches/report/allocations.rs"]
mod allocations;
mod answers;
mod auto;
mod carter;
mod case_faults;
mod case_mutations;
mod cases;
mod conformal;
mod convergence_domain;
mod cylinders;
#[path = "../../benches/stress/damaged.rs"]
mod damaged;
#[path = "../../benches/stress/damaged_trials.rs"]
mod damaged_trials;
mod en15302;
mod equations;
mod fastsim;
mod force_target;
mod forces;
mod forces_reference;
mod friction;
mod friction_along;
mod friction_laws;
mod friction_passage;
mod gap_faults;
mod gap_hertz;
mod gap_reference;
mod gap_robustness;
mod gap_samples;
mod gap_two_patches;
mod golden;
mod gradients;
mod guard_rail;
mod held_out;
mod hertz;
mod histories;
mod history_falling;
mod history_faults;
#[path = "../../benches/calibrate/judge.rs"]
mod judge;
mod kalker;
mod kalker_table;
mod laws;
mod liu_hsu;
mod liu_hsu_newton;
mod maintenance;
mod many_rows;
mod memory;
mod paper_figures;
#[path = "../../benches/calibrate/patches.rs"]
mod patches;
#[path = "../../benches/calibrate/population.rs"]
mod population;
mod power;
mod pressing;
mod pressure_grid;
mod pressure_grid_faults;
mod pressure_grid_shapes;
mod pressure_samples;
mod problem;
mod profile_assessment;
mod profile_case_faults;
mod profile_cases;
mod profile_conforming;
mod profile_damage;
mod profile_faults;
mod profile_forces;
mod profile_formats;
mod profile_geometry;
mod profile_histories;
mod profile_laws;
mod profile_manchester;
mod profile_planes;
mod profile_reference;
mod profile_reference_files;
mod profile_remarks;
mod profile_robustness;
mod profile_senses;
mod profile_shapes;
mod profile_solutions;
mod profile_variants;
mod profile_verdicts;
mod profile_worn;
#[path = "../../benches/random.rs"]
mod random;
mod readme;
mod recorder;
mod reference;
mod reference_hertz;
mod regions;
mod robustness;
mod skips;
mod stress;
mod subsurface;
mod subsurface_passage;
mod sweeps;
mod table;
mod table_rows;
mod targets;
#[path = "../../benches/calibrate/truth.rs"]
mod truth;
mod units;
mod unlike;
mod unlike_wheels;
mod watched;
mod wear;
mod wheelset;
mod wheelset_pulls;
mod workspaces;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;
