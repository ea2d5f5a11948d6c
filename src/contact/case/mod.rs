//! The question: the words a client writes, how they are read, and what they become once checked.

pub mod after_tasks;
pub mod check;
pub mod checks;
pub mod contact_task;
pub mod conversions;
pub mod digest;
pub mod elasticity;
pub mod flange_back;
pub mod history;
pub mod known_pair;
pub mod length_units;
pub mod limits;
pub mod motions;
pub mod read;
pub mod resolution;
pub mod section_check;
pub mod solve_time;
pub mod subsurface;
pub mod understood;
pub(crate) mod units;
pub mod wheel_task;
pub mod wheelsets;
pub mod words;
