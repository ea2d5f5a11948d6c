//! What a case will cost, estimated before it is queued: memory from its finest mesh (`problem/memory.rs`), time from its motions (`solve_time.rs`).

use crate::contact::problem::checked_case::CheckedCase;

impl CheckedCase {
    /// Estimated cost of solving this: the operator of the finest mesh and what stands beside it, the matrices of the dense method,
    /// the answer. What the process keeps for all cases, the operator store, comes on top. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost {
            bytes: self.size_input().bytes() as u64,
            seconds: self.solve_time().whole,
        }
    }
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}
