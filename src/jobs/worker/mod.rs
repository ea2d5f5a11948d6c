//! Workers: claim, solve, finish. A single job is a group of one.

pub mod evolution;
pub mod heartbeat;
pub mod pool;
pub mod record;
pub mod solve;
pub mod turn;
