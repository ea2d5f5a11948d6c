//! An attempt at claimed jobs and all that belongs to it: its thread, its pause point, its lease, its slices and its outcomes.
//!
//! What a worker does with an attempt stands in [`worker`](crate::worker). The parts are here, because all of the crate may stop an
//! attempt, and those that wait for their turn ([`fair_scheduler`]) are shared by the workers.

pub mod attempt;
pub mod fair_scheduler;
pub mod slices;
