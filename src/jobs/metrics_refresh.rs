//! Metrics that are read from the store when they are scraped.

use std::sync::atomic::Ordering;

use prometheus_client::registry::Registry;

use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::metrics::state_label;
use crate::model::State;
use crate::storage_fault::StoragePlace;

impl Jobs {
    /// The registry of the metrics of this crate.
    #[must_use]
    pub fn metrics(&self) -> &Registry {
        &self.shared.registry
    }

    /// Updates the metrics that are read from the store, not counted as they happen.
    ///
    /// # Errors
    /// The database failed.
    pub async fn refresh_metrics(&self) -> Result<()> {
        let metrics = &self.shared.metrics;
        metrics.workers.set(count(self.shared.options.workers));
        let abandoned = self.shared.abandoned.load(Ordering::Acquire);
        metrics.abandoned.set(count(abandoned));
        let stats = self.shared.store.stats().await.map_err(JobsError::from);
        if stats.is_err() {
            self.shared.observe_storage(StoragePlace::Table, &stats);
        }
        metrics.storage_failing(self.shared.storage.any());
        let stats = match stats {
            // The alert for this must not fail with it.
            Err(error) if error.storage_fault().is_some() => return Ok(()),
            stats => stats?,
        };
        let queued = stats.jobs.get(&State::Queued).copied().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "an estimate")]
        metrics
            .queue_cost_seconds
            .set(queued as f64 * stats.mean_cost_us * 1e-6);
        for (state, jobs) in stats.jobs {
            let gauge = metrics.jobs.get_or_create_owned(&state_label(state));
            gauge.set(i64::try_from(jobs).unwrap_or(i64::MAX));
        }
        let age_ms = stats
            .oldest_queued_at
            .map_or(0, |created| (self.shared.now_ms() - created).max(0));
        #[expect(clippy::cast_precision_loss, reason = "an age is far below 2^53 ms")]
        metrics.oldest_queued_seconds.set(age_ms as f64 / 1000.0);
        let bytes = |bytes: u64| i64::try_from(bytes).unwrap_or(i64::MAX);
        metrics.database_bytes.set(bytes(stats.database_bytes));
        metrics.result_bytes.set(bytes(stats.result_bytes));
        let operators = self.shared.engine.operators.bytes();
        metrics.operator_bytes.set(bytes(operators));
        Ok(())
    }
}

fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}
