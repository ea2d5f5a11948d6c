//! An API key: what is kept of it and what it looks like.

use std::sync::Arc;
use std::time::Instant;

use crate::jobs::model::labels::Labels;

/// The tenant of requests without a key.
pub const ANONYMOUS: &str = "anonymous";

/// The tenant whose keys may read the metrics of the whole service.
pub const OPERATOR: &str = "operator";

/// Longest name of a tenant in characters.
const TENANT_MAX_CHARS: usize = 64;

/// What every key begins with, so that scanners for leaked secrets recognise it.
pub(crate) const MARK: &str = "rh_";

/// What is kept of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The part of the key that is no secret; names it in lists and logs.
    pub id: String,
    /// BLAKE3 of the whole key. A key is 256 random bits, so a fast hash is enough.
    pub hash: blake3::Hash,
    /// Whose jobs it opens.
    pub tenant: Arc<str>,
    /// What it is for, in the operator's words.
    pub name: Option<String>,
    /// Time of creation, epoch milliseconds.
    pub created_at: i64,
    /// Time since which it is refused.
    pub revoked_at: Option<i64>,
    /// It reads what is the tenant's, and changes nothing.
    pub read_only: bool,
    /// It opens only what carries these labels, and gives them to what it makes; everything of the tenant without any.
    pub labels: Arc<Labels>,
}

/// Keys found good, with the time at which they were looked up.
pub(crate) type Trusted = std::collections::HashMap<String, (Key, Instant)>;

/// 1 to 64 letters, digits, dots, dashes and underscores.
pub(crate) fn is_tenant(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    (1..=TENANT_MAX_CHARS).contains(&name.len()) && name.bytes().all(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_tenants_are_plain() {
        for good in ["a", "Network-Rail_2.north", &"x".repeat(64)] {
            assert!(is_tenant(good), "{good}");
        }
        for bad in ["", "a b", "ä", "a/b", "a\n", &"x".repeat(65)] {
            assert!(!is_tenant(bad), "{bad:?}");
        }
    }
}
