//! Claim, solve, finish: one path for every group of jobs; a single job is a group of one.

pub mod begin;
pub mod claim_loop;
pub mod disposition;
pub mod evolution;
pub mod heartbeat;
pub mod pool;
pub mod record;
pub mod rows;
pub mod slice_storage;
pub mod solve;
pub mod turn;
