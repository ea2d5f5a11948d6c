//! Does the physics hold?

mod convergence_domain;
mod equations;
mod liu_hsu;
mod liu_hsu_newton;
mod regions;
