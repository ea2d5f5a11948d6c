//! A case: the members that a client writes, how they are read and checked.

pub mod after_tasks;
pub mod check;
pub mod checks;
pub mod contact_task;
pub mod conversions;
pub mod digest;
pub mod draft;
pub mod motions;
pub mod rail_pair;
pub mod solve_time;
pub mod solver;
pub mod understood;
pub(crate) mod units;
pub mod wheel_task;
pub mod wheelsets;
pub mod words;
