//! Many rows with any column and any method: what they are, which of them are like each other, and how they are solved.

mod likeness;
mod near_rows;
mod row_solver;
pub mod solve;
pub mod task;
