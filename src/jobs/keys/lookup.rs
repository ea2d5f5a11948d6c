//! Finds the key of a request, in memory if it was found a moment ago, else in the store.

use std::time::{Duration, Instant};

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::key::{Key, MARK};
use crate::jobs::sync::lock;

/// How long a valid key is not read again; a revoked one stops working within this time.
const TRUSTED_FOR: Duration = Duration::from_secs(1);

/// Keys remembered at most.
const REMEMBERED: usize = 4096;

impl Jobs {
    /// The key that `text` is, if it was found a moment ago.
    #[must_use]
    pub fn remembered_key(&self, text: &str) -> Option<Key> {
        let id = id_of(text)?;
        let trusted = lock(&self.shared.trusted);
        let (key, since) = trusted.get(id)?;
        let good = since.elapsed() < TRUSTED_FOR && key.hash == blake3::hash(text.as_bytes());
        good.then(|| key.clone())
    }

    /// The key that `text` is, if it is one that is not revoked. Hashes are compared in constant time.
    ///
    /// # Errors
    /// The database failed.
    pub async fn key(&self, text: &str) -> Result<Option<Key>, JobsError> {
        let Some(id) = id_of(text) else {
            return Ok(None);
        };
        let hash = blake3::hash(text.as_bytes());
        if let Some((key, since)) = lock(&self.shared.trusted).get(id)
            && since.elapsed() < TRUSTED_FOR
        {
            return Ok((key.hash == hash).then(|| key.clone()));
        }
        // Taken before the read: a key that is revoked meanwhile is not trusted for longer.
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

    /// Is there any key that is not revoked?
    ///
    /// # Errors
    /// The database failed.
    pub async fn any_key(&self) -> Result<bool, JobsError> {
        let keys = self.shared.store.keys().await?;
        Ok(keys.iter().any(|key| key.revoked_at.is_none()))
    }
}

/// The part of a key that is no secret.
fn id_of(text: &str) -> Option<&str> {
    let (id, _) = text.strip_prefix(MARK)?.split_once('_')?;
    Some(id)
}
