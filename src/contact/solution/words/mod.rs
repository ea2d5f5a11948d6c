//! The words of an answer: units in the names, no arithmetic.

pub mod answer;
pub mod damage;
pub mod evolution;
