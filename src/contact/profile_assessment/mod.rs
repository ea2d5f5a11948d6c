//! Solves a wheel on a rail and assesses its profiles: their quality under every patch, their defects, and the uncertainty of the answer due to
//! their measurement. If the answer would be unreliable, the solve fails instead.

pub mod judge;
pub mod trust;
pub mod uncertainty;
