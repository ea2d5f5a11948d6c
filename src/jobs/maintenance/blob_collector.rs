//! Removes large results that no job refers to any more.

use std::sync::Arc;

use crate::jobs::error::JobsError;
use crate::jobs::shared::Shared;

/// Results checked in one call by the sweep for orphans.
const SWEEP_CHUNK: usize = 500;

/// Results taken from the outbox at once.
const COLLECT_CHUNK: u32 = 500;

impl Shared {
    /// Removes large results that no job refers to any more. What cannot be removed now is tried again later.
    pub(crate) async fn collect_blobs(&self) {
        let mut done = Vec::new();
        loop {
            let released = match self.store.released_blobs(&done, COLLECT_CHUNK).await {
                Ok(released) => released,
                Err(error) => {
                    tracing::warn!(%error, "results without a job could not be looked for");
                    return;
                }
            };
            done.clear();
            for key in released {
                match self.blobs.remove(&key).await {
                    Ok(()) => done.push(key),
                    Err(error) => {
                        tracing::warn!(key, %error, "a result without a job could not be removed yet");
                    }
                }
            }
            if done.is_empty() {
                return;
            }
        }
    }
}

/// Removes results that no job refers to and that are not on their way to one: what a process left behind that was
/// killed between the two. Runs once, beside everything else.
pub(crate) async fn sweep_orphans(shared: Arc<Shared>) {
    if shared.store.cluster().is_some() {
        // There may be very many, and other nodes: the database looks for them itself, once in a while.
        return;
    }
    let draining = &shared.draining;
    match draining.run_until_cancelled(sweep(&shared)).await {
        Some(Ok(0)) | None => {}
        Some(Ok(removed)) => tracing::info!(removed, "orphaned results removed"),
        Some(Err(error)) => tracing::warn!(%error, "orphaned results could not be swept"),
    }
}

async fn sweep(shared: &Shared) -> Result<usize, JobsError> {
    shared.collect_blobs().await;
    let mut removed = 0;
    for month in shared.blobs.months().await? {
        for some in shared.blobs.keys(&month).await?.chunks(SWEEP_CHUNK) {
            for key in shared.store.orphans(some).await? {
                shared.blobs.remove(&key).await?;
                removed += 1;
            }
        }
    }
    Ok(removed)
}
