//! The question: the words a client writes, how they are read, and what they become once checked.

pub mod after_tasks;
pub mod after_time;
pub mod check;
pub mod checks;
pub mod contact_task;
pub mod conversions;
pub mod cost;
pub mod digest;
pub mod elasticity;
pub mod history;
pub mod known_pair;
pub mod length_units;
pub mod limits;
pub mod motions;
pub mod pair_quality;
pub mod patch_guess;
pub mod read;
pub mod resolution;
pub mod section_check;
pub mod size_faults;
pub mod solve_time;
pub mod subsurface;
pub mod understood;
pub mod wheel_task;
pub mod wheelsets;
pub mod words;
