//! What one case may use.

use crate::contact::rolling::operator_store::BYTES_DEFAULT;

/// What one solve may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Estimated memory of one case in bytes.
    pub memory_bytes: u64,
    /// Bound of the store of operators that it shares with others, in bytes.
    pub operator_store_bytes: u64,
    /// Motions in one case.
    pub motions_max: usize,
    /// Samples of a grid (one axis times the other).
    pub samples_max: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            memory_bytes: 2 << 30,
            operator_store_bytes: BYTES_DEFAULT,
            motions_max: 10_000,
            samples_max: 1_000_000,
        }
    }
}
