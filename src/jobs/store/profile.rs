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

/// What a list says of a stored cross-section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileEntry {
    /// Its digest.
    pub digest: String,
    /// Its size.
    pub bytes: u64,
    /// When it was first sent, epoch milliseconds.
    pub created_at: i64,
}

/// The last entry of a page: its time in ms and the first digits of its digest. As text 40 characters of `[0-9a-f]`, as the cursors of other lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileCursor(pub i64, pub String);

impl ProfileCursor {
    /// The cursor behind this entry.
    #[must_use]
    pub fn after(entry: &ProfileEntry) -> ProfileCursor {
        let digits = entry.digest.chars().take(28);
        ProfileCursor(entry.created_at, digits.collect())
    }

    /// The cursor that a text is.
    #[must_use]
    pub fn read(text: &str) -> Option<ProfileCursor> {
        let (time, digest) = text.split_at_checked(12)?;
        let time = i64::from_str_radix(time, 16).ok()?;
        let cursor = ProfileCursor(time, digest.to_owned());
        (digest.len() == 28 && cursor.to_string() == text).then_some(cursor)
    }
}

impl std::fmt::Display for ProfileCursor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:012x}{}", self.0, self.1)
    }
}
