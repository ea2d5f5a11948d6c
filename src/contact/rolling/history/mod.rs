//! Rolling that changes, and shift: one tangential problem per step of distance, each of which remembers the displacements before it.

pub(crate) mod level_record;
pub mod level_run;
pub mod plan;
pub(crate) mod self_similar;
pub mod solve;
