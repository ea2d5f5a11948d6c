//! Identical cases are solved once: a later one gets the result of an earlier one, within the same tenant.

use uuid::Uuid;

use crate::error::Result;
use crate::handle::Jobs;
use crate::model::State;
use crate::shared::Shared;
use crate::store::{CacheKey, NewJob};

impl Jobs {
    /// The key of a case with this digest; `None` if results are not to be used again.
    pub(crate) fn cache_key(&self, digest: &str) -> Option<CacheKey> {
        if !self.shared.options.cache {
            return None;
        }
        let mut hasher = blake3::Hasher::new();
        // A tenant must not learn from a fast answer what another one had solved.
        hasher.update(self.tenant.as_bytes());
        hasher.update(&[0]);
        hasher.update(digest.as_bytes());
        let mut key = CacheKey::default();
        hasher.finalize_xof().fill(&mut key);
        Some(key)
    }

    /// Gives each of the jobs about to be queued its source, if there is one.
    pub(crate) async fn find_sources(&self, jobs: impl Iterator<Item = &mut NewJob>) -> Result<()> {
        let jobs: Vec<_> = jobs.collect();
        let keys: Vec<_> = jobs.iter().filter_map(|job| job.cache_key).collect();
        if keys.is_empty() {
            return Ok(());
        }
        let sources = self.shared.store.cached(&keys).await?;
        let (mut hits, now) = (0, self.shared.now_ms());
        for job in jobs {
            let source = job.cache_key.and_then(|key| sources.get(&key));
            job.source = source.map(|source| (*source, now));
            hits += u64::from(job.source.is_some());
        }
        self.shared
            .metrics
            .cache_lookup(hits, keys.len() as u64 - hits);
        Ok(())
    }
}

impl Shared {
    /// Jobs ended with the result of their source.
    pub(crate) fn ended_cached(&self, ids: &[Uuid]) {
        self.metrics.ended(State::Succeeded, ids.len() as u64);
        for id in ids {
            self.announce(*id);
        }
    }
}
