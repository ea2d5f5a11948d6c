//! Why a table of a client is refused.

use std::io;

/// Why a table cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The table is not of its form, or some of its columns are faulty.
    #[error("{detail}")]
    Faulty {
        /// The whole refusal.
        detail: String,
        /// Each faulty column by its title, with its fault.
        columns: Vec<(String, String)>,
    },
    /// The table is larger than allowed, packed or unpacked.
    #[error("{0}")]
    TooLarge(String),
    /// The source of the table, such as a file, cannot be read.
    #[error(transparent)]
    Source(#[from] io::Error),
}

/// The result of a call that reads a table.
pub type Result<T, E = TableError> = std::result::Result<T, E>;

/// The refusal of a table as a whole.
pub fn faulty(detail: impl Into<String>) -> TableError {
    TableError::Faulty {
        detail: detail.into(),
        columns: Vec::new(),
    }
}

/// The refusal of an archive that is larger than this, packed or unpacked.
#[must_use]
pub fn too_large(max_bytes: usize) -> TableError {
    TableError::TooLarge(format!(
        "the arrays are larger than the {max_bytes} bytes that are allowed (`--evaluate-max-mib`)"
    ))
}
