//! What a case will cost, estimated before it is queued: memory from its meshes (`problem/memory.rs`), time from its motions (`solve_time.rs`).

use crate::contact::problem::checked_case::CheckedCase;

impl CheckedCase {
    /// Estimated cost of solving this: the operators of its meshes and what stands beside them, the matrices of the dense method, the
    /// answer. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        let size = self.size_input();
        Cost {
            bytes: size.bytes() as u64,
            operator_store_bytes: size.stored() as u64,
            seconds: self.solve_time().whole,
        }
    }
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Of these, what its operators take of the store of the process.
    pub operator_store_bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}

impl Cost {
    /// Memory in bytes that nobody shares.
    #[must_use]
    pub fn own_bytes(&self) -> u64 {
        self.bytes.saturating_sub(self.operator_store_bytes)
    }
}
