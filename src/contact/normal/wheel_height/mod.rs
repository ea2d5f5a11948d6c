//! The height of a wheel above the rail at which normal forces carry its load.

pub mod bracket;
pub mod gap_remarks;
pub mod pressed;
pub mod search;
pub mod task;
pub mod wheelset_task;
