//! The words of an answer: units in the names, no arithmetic.

pub mod answer;
pub mod damage;
pub mod evolution;
pub mod fields;
pub mod maintenance;
pub mod profile_quality;
pub mod understanding;
pub mod wheelset;
