//! API keys, which assign requests to tenants.
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::clock::Clock;
use crate::data_dir::table_file;
use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::{KEY_PREFIX, Key, Labels, is_tenant};
use crate::store::Store;
use crate::store::open::{open_beside, open_shared};
use crate::sync::lock;

/// The keys of a data folder or database; also usable while a service runs.
#[derive(Debug)]
pub struct Keyring {
    store: Arc<dyn Store>,
}

impl Keyring {
    /// Opens the keys of an existing data folder, whose job table is created if necessary.
    ///
    /// # Errors
    /// The folder does not exist or cannot be used.
    pub async fn open(data_dir: &Path) -> Result<Keyring> {
        std::fs::read_dir(data_dir).map_err(JobsError::at(data_dir))?;
        let store = open_beside(data_dir).await?;
        Ok(Keyring { store })
    }

    /// Opens the keys in a database.
    ///
    /// # Errors
    /// The database cannot be reached, has no job table, or one of another version.
    pub async fn open_shared(url: &str) -> Result<Keyring> {
        let store = open_shared(url).await?;
        Ok(Keyring { store })
    }

    /// Whether this is the data folder of a service.
    #[must_use]
    pub fn is_there(data_dir: &Path) -> bool {
        table_file(data_dir).is_file()
    }

    /// Creates a key of a tenant and returns it with its secret, which is not stored.
    ///
    /// # Errors
    /// [`JobsError::BadTenant`], no source of randomness, or a failed database.
    pub async fn create(
        &self,
        tenant: &str,
        name: Option<String>,
        read_only: bool,
        labels: Labels,
    ) -> Result<(Key, String)> {
        if !is_tenant(tenant) {
            return Err(JobsError::BadTenant);
        }
        let mut id = [0; 6];
        let mut secret = [0; 32];
        getrandom::fill(&mut id)
            .and_then(|()| getrandom::fill(&mut secret))
            .map_err(|error| JobsError::Damaged(format!("no randomness: {error}")))?;
        let id = hex(&id);
        let text = format!("{KEY_PREFIX}{id}_{}", hex(&secret));
        let key = Key {
            id,
            hash: blake3::hash(text.as_bytes()),
            tenant: tenant.into(),
            name,
            created_at: Clock::system().now_ms(),
            revoked_at: None,
            read_only,
            labels: Arc::new(labels),
        };
        self.store.add_key(&key).await?;
        Ok((key, text))
    }

    /// Lists all keys, oldest first, including revoked ones.
    ///
    /// # Errors
    /// The database failed.
    pub async fn list(&self) -> Result<Vec<Key>> {
        Ok(self.store.keys().await?)
    }

    /// Revokes the key with this id; `None` if it does not exist.
    ///
    /// # Errors
    /// The database failed.
    pub async fn revoke(&self, id: &str) -> Result<Option<Key>> {
        Ok(self.store.revoke_key(id, Clock::system().now_ms()).await?)
    }

    /// Closes the job table.
    pub async fn close(self) {
        self.store.close().await;
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// How long a valid key is cached; a revoked key stops working within this time.
const TRUSTED_FOR: Duration = Duration::from_secs(1);

/// Maximum number of cached keys.
const REMEMBERED: usize = 4096;

impl Jobs {
    /// The key with this text, if it is cached.
    #[must_use]
    pub fn remembered_key(&self, text: &str) -> Option<Key> {
        let id = id_of(text)?;
        let trusted = lock(&self.shared.trusted);
        let (key, since) = trusted.get(id)?;
        let good = since.elapsed() < TRUSTED_FOR && key.hash == blake3::hash(text.as_bytes());
        good.then(|| key.clone())
    }

    /// The key with this text, unless it is unknown or revoked. Hashes are compared in constant time.
    ///
    /// # Errors
    /// The database failed.
    pub async fn key(&self, text: &str) -> Result<Option<Key>> {
        let Some(id) = id_of(text) else {
            return Ok(None);
        };
        let hash = blake3::hash(text.as_bytes());
        if let Some((key, since)) = lock(&self.shared.trusted).get(id)
            && since.elapsed() < TRUSTED_FOR
        {
            return Ok((key.hash == hash).then(|| key.clone()));
        }
        // Taken before the read, so that a key that is revoked meanwhile is not cached for longer.
        let now = Instant::now();
        let found = self.shared.store.key(id).await?;
        let good = found.filter(|key| key.hash == hash && key.revoked_at.is_none());
        let mut trusted = lock(&self.shared.trusted);
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

    /// Whether there is a key that is not revoked.
    ///
    /// # Errors
    /// The database failed.
    pub async fn any_key(&self) -> Result<bool> {
        let keys = self.shared.store.keys().await?;
        Ok(keys.iter().any(|key| key.revoked_at.is_none()))
    }
}

/// The public part of a key.
fn id_of(text: &str) -> Option<&str> {
    let (id, _) = text.strip_prefix(KEY_PREFIX)?.split_once('_')?;
    Some(id)
}
