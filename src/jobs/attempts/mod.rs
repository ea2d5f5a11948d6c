//! State of attempts at claimed jobs.
//!
//! [`worker`](crate::worker) runs attempts. Their state is separate, because other modules stop attempts, and the workers
//! share the [`fair_scheduler`].

pub mod attempt;
pub mod fair_scheduler;
pub mod slices;
