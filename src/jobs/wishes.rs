//! What a client may wish for its jobs besides their answers: which of them come first, by when they must have ended, and
//! that nothing earlier is used again.

use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::jobs::Shared;
use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, FailureKind};
use crate::jobs::store::sqlite::deadlines::Moment;
use crate::jobs::watch::Reason;

/// Time between two looks for jobs whose deadline has passed.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Which of its queued jobs a tenant wants solved first. Among tenants it means nothing: they take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Priority {
    /// Before all others.
    High,
    /// Oldest first.
    #[default]
    Normal,
    /// When nothing else of the tenant is queued.
    Low,
}

impl Priority {
    /// Every priority, the first to be solved first.
    pub const ALL: [Priority; 3] = [Priority::High, Priority::Normal, Priority::Low];

    /// The word for it in the API.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Priority::High => "high",
            Priority::Normal => "normal",
            Priority::Low => "low",
        }
    }

    /// The priority of that name, if there is one.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Priority> {
        Priority::ALL.into_iter().find(|one| one.name() == name)
    }

    /// The number for it in the database: its place in [`Priority::ALL`].
    pub(in crate::jobs) fn rank(self) -> i64 {
        match self {
            Priority::High => 0,
            Priority::Normal => 1,
            Priority::Low => 2,
        }
    }

    pub(super) fn from_rank(rank: i64) -> Option<Priority> {
        Priority::ALL.into_iter().find(|one| one.rank() == rank)
    }
}

/// What a client wishes for one job or for all of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wishes {
    /// Its place among the queued jobs of the tenant.
    pub priority: Priority,
    /// Time after the submission within which it must have ended; `None`: it may take any time.
    pub ends_within: Option<Duration>,
    /// It is solved even if an identical case was solved before.
    pub fresh: bool,
}

impl Wishes {
    /// The digest of a submission, for its idempotency key: of what is asked and of the wishes that come with it.
    pub(super) fn digest(&self, asked: &[u8; 32]) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(asked);
        hasher.update(&self.priority.rank().to_le_bytes());
        let within = self.ends_within.map_or(u128::MAX, |time| time.as_millis());
        hasher.update(&within.to_le_bytes());
        hasher.update(&[u8::from(self.fresh)]);
        *hasher.finalize().as_bytes()
    }
}

/// Why a job that came too late has no answer.
pub(super) fn too_late() -> Failure {
    Failure::new(
        FailureKind::DeadlinePassed,
        "the deadline of the job passed before it had ended",
    )
}

/// Ends jobs whose deadline has passed, once a second until the service drains: queued ones at once, running ones at
/// the next tick of their solvers.
pub(super) async fn keep_deadlines(shared: Arc<Shared>) {
    let mut beat = tokio::time::interval(LOOK_EVERY);
    let draining = shared.draining.clone();
    while draining.run_until_cancelled(beat.tick()).await.is_some() {
        if let Err(error) = end_late_jobs(&shared).await {
            tracing::warn!(%error, "deadlines could not be looked at");
        }
    }
}

async fn end_late_jobs(shared: &Shared) -> Result<(), JobsError> {
    let (now, leap) = (shared.now_ms(), shared.leap());
    let moment = Moment {
        now,
        set_at: leap.at,
        unset: now.saturating_sub(leap.ms),
    };
    let late = shared.store.late(moment).await?;
    let mut more = late.queued;
    while more {
        let ended = shared.store.fail_late(&too_late(), moment).await?;
        for id in &ended {
            tracing::info!(job = %id, "deadline passed, job ended");
            shared.metrics.failed(FailureKind::DeadlinePassed);
            shared.announce(*id);
        }
        more = !ended.is_empty();
    }
    for id in late.running {
        stop(shared, id);
    }
    Ok(())
}

fn stop(shared: &Shared, id: Uuid) {
    if let Some(watch) = shared.running().get(&id) {
        watch.stop(Reason::Deadline);
    }
}
