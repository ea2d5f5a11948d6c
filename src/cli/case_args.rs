//! What one case may use: flags of `serve` and `solve`.

use clap::Args;

use crate::contact::case::solver::Limits;
use crate::contact::rolling::operator_store::{BYTES_DEFAULT, OperatorStore};

/// What one case may use.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct CaseArgs {
    /// Estimated memory beyond which a case is refused, in MiB.
    #[arg(long, env = "RAILHEAD_MEMORY_LIMIT_MB", default_value_t = 2048, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    pub memory_limit_mb: u64,
    /// Memory for operators of meshes, in MiB, kept for the next cases of the same shape and shared by all workers; 0: none are kept.
    #[arg(long, env = "RAILHEAD_OPERATOR_STORE_MB", default_value_t = BYTES_DEFAULT >> 20, value_name = "MIB",
          value_parser = clap::value_parser!(u64).range(..=1 << 30))]
    pub operator_store_mb: u64,
}

impl CaseArgs {
    /// The limits that cases are checked against.
    #[must_use]
    pub(super) fn limits(self) -> Limits {
        Limits {
            memory_bytes: self.memory_limit_mb << 20,
            operator_store_bytes: self.operator_store_mb << 20,
            ..Limits::default()
        }
    }

    /// The store of operators that all solves share.
    #[must_use]
    pub(super) fn operators(self) -> OperatorStore {
        OperatorStore::new(self.operator_store_mb << 20)
    }
}
