//! What a client may ask for its jobs besides their answers: their priority, their deadline, and that no earlier result is
//! used.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

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

names! {
    pub Priority {
        High = "high",
        Normal = "normal",
        Low = "low",
    }
}

impl Priority {
    /// The number for it in the database: its place in [`Priority::ALL`].
    pub(crate) fn rank(self) -> i64 {
        match self {
            Priority::High => 0,
            Priority::Normal => 1,
            Priority::Low => 2,
        }
    }

    pub(crate) fn from_rank(rank: i64) -> Option<Priority> {
        Priority::ALL.into_iter().find(|one| one.rank() == rank)
    }
}

/// Options of a submission: of one job, or of all jobs of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SubmitOptions {
    /// Its place among the queued jobs of the tenant.
    pub priority: Priority,
    /// Time after the submission within which it must have ended; `None`: it may take any time.
    pub ends_within: Option<Duration>,
    /// It is solved even if an identical case was solved before.
    pub bypass_cache: bool,
}

/// Options that one case of a batch has for itself, in place of those of the batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CaseOptions {
    /// In place of [`SubmitOptions::priority`].
    pub priority: Option<Priority>,
    /// In place of [`SubmitOptions::ends_within`], in s.
    pub deadline_s: Option<u32>,
}

impl SubmitOptions {
    /// The options of a case with some of its own.
    #[must_use]
    pub fn of_case(self, own: CaseOptions) -> SubmitOptions {
        let within = |seconds: u32| Duration::from_secs(seconds.into());
        SubmitOptions {
            priority: own.priority.unwrap_or(self.priority),
            ends_within: own.deadline_s.map(within).or(self.ends_within),
            bypass_cache: self.bypass_cache,
        }
    }

    /// The digest of a submission for its idempotency key: of the case or cases, and of these options.
    pub(crate) fn digest(&self, asked: &[u8; 32]) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(asked);
        hasher.update(&self.priority.rank().to_le_bytes());
        let within = self.ends_within.map_or(u128::MAX, |time| time.as_millis());
        hasher.update(&within.to_le_bytes());
        hasher.update(&[u8::from(self.bypass_cache)]);
        *hasher.finalize().as_bytes()
    }
}
