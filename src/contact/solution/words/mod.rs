//! The types of an answer, with units in the names of their members.

pub mod answer;
pub mod damage;
pub mod evolution;
