//! Rows of numbers in, resultants out: one case with columns of values in place of some of its numbers, answered without meshes or jobs.

pub mod answer;
pub mod rows;
pub mod variable;
