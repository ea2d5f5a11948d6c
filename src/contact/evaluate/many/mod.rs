//! Many rows with any column and any method: what they are, and how they are solved.

pub mod solve;
pub mod task;
