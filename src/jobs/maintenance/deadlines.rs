//! Ends jobs whose deadline has passed.

use std::sync::Arc;
use std::time::Duration;

use uuid::Uuid;

use crate::jobs::attempts::attempt_control::StopReason;
use crate::jobs::error::JobsError;
use crate::jobs::model::job::{FailureKind, too_late};
use crate::jobs::shared::Shared;
use crate::jobs::store::retention::Moment;

/// Time between two checks for jobs whose deadline has passed.
const DEADLINE_INTERVAL: Duration = Duration::from_secs(1);

/// Ends jobs whose deadline has passed, once a second until the service drains: queued ones at once, running ones at
/// the next tick of their solvers.
pub(crate) async fn watch_deadlines(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(DEADLINE_INTERVAL);
    let draining = shared.draining.clone();
    while draining.run_until_cancelled(beat.tick()).await.is_some() {
        if let Err(error) = enforce_deadlines(&shared).await {
            tracing::warn!(%error, "deadlines could not be checked");
        }
    }
}

async fn enforce_deadlines(shared: &Shared) -> Result<(), JobsError> {
    let (now, leap) = (shared.now_ms(), shared.clock_step());
    let moment = Moment {
        now,
        set_at: leap.at,
        unset: now.saturating_sub(leap.ms),
    };
    let failure = too_late();
    loop {
        let overdue = shared.store.pass_deadlines(&failure, moment).await?;
        for id in &overdue.ended {
            tracing::info!(job = %id, "deadline passed, job ended");
            shared.metrics.failed(FailureKind::DeadlinePassed);
            shared.announce(*id);
        }
        if overdue.ended.is_empty() {
            for id in overdue.running {
                stop(shared, id);
            }
            break;
        }
    }
    Ok(())
}

fn stop(shared: &Shared, id: Uuid) {
    if let Some(control) = shared.running.get(id) {
        control.stop(StopReason::Deadline);
    }
}
