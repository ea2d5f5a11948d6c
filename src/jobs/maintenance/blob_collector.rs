//! Removes large results that no job refers to any more.

use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::shared::Shared;

/// Results checked in one call by the sweep for orphans.
const SWEEP_CHUNK: usize = 500;

/// Time between two looks at results whose jobs were running.
const UNDECIDED_EVERY: Duration = Duration::from_secs(1);

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
/// killed between the two. Runs once, beside everything else, and ends when the last job has ended that was running meanwhile and
/// has such a result.
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
    let (mut removed, mut undecided) = (0, Vec::new());
    for month in shared.blobs.months().await? {
        for some in shared.blobs.keys(&month).await?.chunks(SWEEP_CHUNK) {
            let orphans = shared.store.orphans(some).await?;
            undecided.extend(orphans.undecided);
            removed += remove(shared, &orphans.certain).await?;
        }
    }
    // A job whose process was killed may have been claimed anew before its earlier result was looked at.
    while !undecided.is_empty() {
        tokio::time::sleep(UNDECIDED_EVERY).await;
        let orphans = shared.store.orphans(&undecided).await?;
        undecided = orphans.undecided;
        removed += remove(shared, &orphans.certain).await?;
    }
    Ok(removed)
}

async fn remove(shared: &Shared, keys: &[String]) -> Result<usize, JobsError> {
    for key in keys {
        shared.blobs.remove(key).await?;
    }
    Ok(keys.len())
}

/// Results written less long ago may be on their way to their job, in ms.
const YOUNG: i64 = 24 * 3600 * 1000;

impl Jobs {
    /// Removes results outside the database that no job refers to and that were written more than a day ago; returns their number.
    /// The nodes of a database do so by themselves, one of them once a day.
    ///
    /// # Errors
    /// The database or the place of the results failed; the next sweep will go on.
    pub async fn sweep_old_results(&self) -> Result<u64, JobsError> {
        self.shared.sweep_old_results().await
    }
}

impl Shared {
    /// Removes results outside the database that no job refers to and that were written more than a day ago; returns their number.
    /// Several nodes may do so at once.
    pub(crate) async fn sweep_old_results(&self) -> Result<u64, JobsError> {
        let before = self.now_ms() - YOUNG;
        let mut listed = self.blobs.listed();
        let (mut some, mut removed) = (Vec::new(), 0);
        loop {
            let next = listed.try_next().await?;
            let last = next.is_none();
            if let Some((job, key, written)) = next
                && written < before
                && some.last().is_none_or(|(_, known)| *known != key)
            {
                some.push((job, key));
            }
            if some.len() >= SWEEP_CHUNK || last {
                for key in self.store.orphans(&some).await?.certain {
                    self.blobs.remove(&key).await?;
                    self.metrics.results_swept.inc();
                    removed += 1;
                }
                some.clear();
            }
            if last {
                return Ok(removed);
            }
        }
    }
}
