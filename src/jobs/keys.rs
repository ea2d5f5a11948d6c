//! API keys: which tenant a request belongs to. Of a key only its hash is kept.

use std::path::Path;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use crate::jobs::Jobs;
use crate::jobs::clock::Clock;
use crate::jobs::error::JobsError;
use crate::jobs::store::sqlite::SqliteStore;

/// The tenant of requests without a key.
pub const ANONYMOUS: &str = "anonymous";
/// The tenant whose keys may read the figures of the whole service.
pub const OPERATOR: &str = "operator";

/// Longest name of a tenant in characters.
const TENANT_MAX_CHARS: usize = 64;
/// What every key begins with, so that scanners for leaked secrets recognise it.
const MARK: &str = "rh_";
/// How long a key that was found good is not looked up again; a revoked one stops within this time.
const TRUSTED_FOR: Duration = Duration::from_secs(1);
/// Keys remembered at most.
const REMEMBERED: usize = 4096;

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
}

/// Keys found good, with the time at which they were looked up.
pub(super) type Trusted = std::collections::HashMap<String, (Key, Instant)>;

/// The keys of a data folder, also beside a running service.
#[derive(Debug)]
pub struct Keyring {
    store: SqliteStore,
}

impl Keyring {
    /// Opens the keys of a data folder. The folder must be there; a new one gets its job table.
    ///
    /// # Errors
    /// There is no such folder, or it cannot be used.
    pub async fn open(data_dir: &Path) -> Result<Keyring, JobsError> {
        std::fs::read_dir(data_dir).map_err(|source| JobsError::DataDir {
            path: data_dir.to_owned(),
            source,
        })?;
        let store = SqliteStore::open(&data_dir.join("jobs.db")).await?;
        Ok(Keyring { store })
    }

    /// Is this the data folder of a service?
    #[must_use]
    pub fn is_there(data_dir: &Path) -> bool {
        data_dir.join("jobs.db").is_file()
    }

    /// Makes a key of a tenant. The secret, returned second, is shown this one time and kept nowhere.
    ///
    /// # Errors
    /// [`JobsError::BadTenant`], no randomness, or a failed database.
    pub async fn create(
        &self,
        tenant: &str,
        name: Option<String>,
    ) -> Result<(Key, String), JobsError> {
        if !is_tenant(tenant) {
            return Err(JobsError::BadTenant);
        }
        let mut id = [0; 6];
        let mut secret = [0; 32];
        getrandom::fill(&mut id)
            .and_then(|()| getrandom::fill(&mut secret))
            .map_err(|error| JobsError::Damaged(format!("no randomness: {error}")))?;
        let id = hex(&id);
        let text = format!("{MARK}{id}_{}", hex(&secret));
        let key = Key {
            id,
            hash: blake3::hash(text.as_bytes()),
            tenant: tenant.into(),
            name,
            created_at: Clock::system().now_ms(),
            revoked_at: None,
        };
        self.store.add_key(&key).await?;
        Ok((key, text))
    }

    /// All keys, oldest first, the revoked ones included.
    ///
    /// # Errors
    /// The database failed.
    pub async fn list(&self) -> Result<Vec<Key>, JobsError> {
        self.store.keys().await
    }

    /// Revokes a key by its id; `None` if there is none.
    ///
    /// # Errors
    /// The database failed.
    pub async fn revoke(&self, id: &str) -> Result<Option<Key>, JobsError> {
        self.store.revoke_key(id, Clock::system().now_ms()).await
    }

    /// Closes the data folder.
    pub async fn close(self) {
        self.store.close().await;
    }
}

impl Jobs {
    /// The same jobs as one tenant sees them: its own and no others.
    #[must_use]
    pub fn of(&self, tenant: Arc<str>) -> Jobs {
        Jobs {
            shared: self.shared.clone(),
            tenant,
        }
    }

    /// Whose jobs these are.
    #[must_use]
    pub fn tenant(&self) -> &str {
        &self.tenant
    }

    /// The key that `text` is, if it is one that is not revoked. Hashes are compared in constant time.
    ///
    /// # Errors
    /// The database failed.
    pub async fn key(&self, text: &str) -> Result<Option<Key>, JobsError> {
        let Some((id, _)) = text
            .strip_prefix(MARK)
            .and_then(|rest| rest.split_once('_'))
        else {
            return Ok(None);
        };
        let hash = blake3::hash(text.as_bytes());
        let trusted = || {
            let trusted = &self.shared.trusted;
            trusted.lock().unwrap_or_else(PoisonError::into_inner)
        };
        if let Some((key, since)) = trusted().get(id)
            && since.elapsed() < TRUSTED_FOR
        {
            return Ok((key.hash == hash).then(|| key.clone()));
        }
        // Taken before the look: what is revoked meanwhile is not trusted for longer.
        let now = Instant::now();
        let found = self.shared.store.key(id).await?;
        let good = found.filter(|key| key.hash == hash && key.revoked_at.is_none());
        let mut trusted = trusted();
        match &good {
            Some(key) => {
                if trusted.len() >= REMEMBERED {
                    trusted.clear();
                }
                trusted.insert(id.to_owned(), (key.clone(), now));
            }
            None => {
                trusted.remove(id);
            }
        }
        Ok(good)
    }

    /// Is there any key that is not revoked?
    ///
    /// # Errors
    /// The database failed.
    pub async fn any_key(&self) -> Result<bool, JobsError> {
        let keys = self.shared.store.keys().await?;
        Ok(keys.iter().any(|key| key.revoked_at.is_none()))
    }
}

/// 1 to 64 letters, digits, dots, dashes and underscores.
fn is_tenant(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    (1..=TENANT_MAX_CHARS).contains(&name.len()) && name.bytes().all(allowed)
}

fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
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
