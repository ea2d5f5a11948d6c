//! Solves a wheel on a rail and assesses its profiles: their quality under every patch, their defects, and the uncertainty that the
//! measurement leaves in the answer. If the answer would mislead, the solve fails instead.

pub mod judge;
pub mod trust;
pub mod uncertainty;
