//! Claim, solve, finish: one path for every group of jobs, and a job is a group of one.

pub mod attempt;
pub mod attempt_control;
pub mod begin;
pub mod claim_loop;
pub mod fair_turns;
pub mod gate;
pub mod heap;
pub mod heartbeat;
pub mod judge;
pub mod lease;
pub mod outcome;
pub mod pool;
pub mod record;
pub mod rows;
pub mod running;
pub mod slice_storage;
pub mod slices;
pub mod solve;
pub mod solver_thread;
pub mod turn;
