//! Cross-sections that a tenant keeps, so that cases can name them by their digest.

use bytes::Bytes;

/// A kept cross-section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredProfile {
    /// Digest of its JSON value, 64 hexadecimal digits.
    pub digest: String,
    /// Its JSON text.
    pub body: Bytes,
    /// When it was first sent, epoch milliseconds.
    pub created_at: i64,
}

/// What became of a cross-section that was to be kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProfileKept {
    /// It is kept.
    Added,
    /// It was kept already.
    Existing(StoredProfile),
    /// There is no room for it.
    Full,
}
