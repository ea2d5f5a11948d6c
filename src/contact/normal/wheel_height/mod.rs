//! The height of a wheel above the rail at which normal forces carry its load.

pub mod bracket;
pub mod gap_remarks;
pub mod lowered;
pub mod search;
pub mod task;
pub mod wheel_contact;
pub mod wheelset_task;
