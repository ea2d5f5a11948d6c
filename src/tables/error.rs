//! Errors of reading tables.

use std::io;

/// An error of reading a table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The table is malformed, or some of its columns are faulty.
    #[error("{detail}")]
    Faulty {
        /// Description of the error.
        detail: String,
        /// Title and fault of each faulty column.
        columns: Vec<(String, String)>,
    },
    /// The table is larger than allowed, compressed or decompressed.
    #[error("{0}")]
    TooLarge(String),
    /// The source of the table, such as a file, cannot be read.
    #[error(transparent)]
    Source(#[from] io::Error),
}

/// The result of reading a table.
pub type Result<T, E = TableError> = std::result::Result<T, E>;

/// Returns the error of a malformed table.
pub fn faulty(detail: impl Into<String>) -> TableError {
    TableError::Faulty {
        detail: detail.into(),
        columns: Vec::new(),
    }
}

/// Returns the error of an archive that is larger than this, compressed or decompressed.
#[must_use]
pub fn too_large(max_bytes: usize) -> TableError {
    TableError::TooLarge(format!(
        "the arrays are larger than the {max_bytes} bytes that are allowed (`--evaluate-max-mib`)"
    ))
}
