//! Solves a wheel on a rail and says how far its profiles can be trusted: their quality under every patch, what is wrong with them and
//! what the measurement leaves open. Where an answer would mislead there is none.

pub mod finding;
pub mod judge;
pub mod settle;
pub mod trust;
pub mod uncertainty;
