//! A wheel over its rail: what presses them together, and how they touch.

pub mod task;
pub mod wheel_contact;
pub mod wheelset_task;
