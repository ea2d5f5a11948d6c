//! The results of a batch, page by page, in the order of its cases.

use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::BoxStream;
use tokio::time::{Instant, timeout_at};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::{BatchItem, ItemFault};
use crate::jobs::model::job::State;
use crate::jobs::shared::POLL_INTERVAL;

/// Small solutions read at once: once they are this large together, the rest is left for the next page.
pub const PAGE_BYTES: usize = 256 << 10;

/// Pause between two reads of a job that a reader of results waits for.
const REREAD_PAUSE: Duration = Duration::from_millis(10);

/// Size of a solution, and its text without the closing brace.
pub type OpenedItem = (usize, BoxStream<'static, Result<Bytes, JobsError>>);

impl Jobs {
    /// The next jobs of a batch after the job `after`, in the order they were sent, at most `limit`, fewer once
    /// the small results, which are read with them, come to [`PAGE_BYTES`]; large ones are left to [`Jobs::open_item`]. With `until`, only jobs that have ended are returned as long as that time is not reached, and at
    /// least one is waited for. Of these, the ones in one of `states` are returned (all if there is none), with the job after which to go on;
    /// nothing at the end of the batch.
    ///
    /// # Errors
    /// A failed database.
    pub async fn batch_items(
        &self,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        until: Option<Instant>,
        states: &[State],
    ) -> Result<(Vec<BatchItem>, Option<Uuid>), JobsError> {
        let until = until.unwrap_or_else(Instant::now);
        loop {
            // Subscribe first, then read: what ends in between is announced.
            let mut ended = self.shared.ended.subscribe();
            let mut lines = self
                .shared
                .store
                .batch_items(&self.tenant, id, after, limit, PAGE_BYTES)
                .await?;
            lines.retain(|line| *line.job.tenant == *self.tenant);
            let waiting = Instant::now() < until && !self.shared.draining.is_cancelled();
            if waiting {
                let done = lines
                    .iter()
                    .take_while(|line| line.job.state.ended())
                    .count();
                if done == 0
                    && let Some(first) = lines.first().map(|line| line.job.id)
                {
                    while Instant::now() < until
                        && !self.shared.draining.is_cancelled()
                        && self
                            .recent(first, REREAD_PAUSE)
                            .await
                            .is_ok_and(|job| !job.state.ended())
                    {
                        let poll_at = until.min(Instant::now() + POLL_INTERVAL);
                        // A lagging receiver may have missed the announcement, so it reads again as well.
                        let announced =
                            async { while ended.recv().await.is_ok_and(|ended| ended != first) {} };
                        tokio::select! {
                            _ = timeout_at(poll_at, announced) => {}
                            () = self.shared.draining.cancelled() => {}
                        }
                        // Many jobs end in the same moment; one read serves all of them.
                        tokio::time::sleep(REREAD_PAUSE).await;
                        ended = ended.resubscribe();
                    }
                    continue;
                }
                lines.truncate(done);
            }
            let last = lines.last().map(|line| line.job.id);
            if !states.is_empty() {
                lines.retain(|line| states.contains(&line.job.state));
            }
            return Ok((lines, last));
        }
    }

    /// The keys of the labels of the jobs of a batch, sorted, the first `limit`.
    ///
    /// # Errors
    /// A failed database.
    pub async fn batch_label_keys(&self, id: Uuid, limit: u32) -> Result<Vec<String>, JobsError> {
        let store = &self.shared.store;
        Ok(store.batch_label_keys(&self.tenant, id, limit).await?)
    }

    /// The result of a line that lies outside the table: its size, and its text without the closing brace, read while it is taken. What cannot be
    /// read costs its own line and no other.
    ///
    /// # Errors
    /// It went in between, or cannot be read.
    pub async fn open_item(&self, id: Uuid, key: &str) -> Result<OpenedItem, ItemFault> {
        let error = match self.shared.blobs.open_solution(key).await {
            Ok(opened) => return Ok(opened),
            Err(error) => self.gone_meanwhile(id, error).await,
        };
        if matches!(error, JobsError::Expired) {
            return Err(ItemFault::Gone);
        }
        tracing::error!(job = %id, %error, "a stored result cannot be read");
        Err(ItemFault::Unreadable)
    }
}
