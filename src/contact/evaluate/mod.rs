//! Rows in, resultants out: one case with columns of values in place of some of its members. [`rows`] answers numbers without meshes, [`many`]
//! any column with any method.

pub mod answer;
pub mod column;
mod likeness;
pub mod many;
pub mod many_answer;
pub mod many_task;
mod near_rows;
pub mod placing;
pub mod request_faults;
mod row_solver;
pub mod rows;
mod rows_checks;
pub mod sections;
pub mod variable;
pub mod varied;
