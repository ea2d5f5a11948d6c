//! What passes by itself or is removed, and what is counted.

use std::collections::BTreeMap;

use uuid::Uuid;

use crate::jobs::model::job::State;

/// The answer to a call that deletes a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deleted {
    /// The row and all that hung on it are gone.
    Done,
    /// It has not ended.
    NotEnded(State),
    /// There was none.
    NotFound,
}

/// The present, and what became of the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Epoch milliseconds.
    pub now: i64,
    /// What was submitted before this time is judged by the next.
    pub set_at: i64,
    /// The present of a clock that was not set.
    pub unset: i64,
}

/// What is to be removed. Times are epoch milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct RetentionRule {
    /// The present.
    pub now: i64,
    /// Jobs that ended at this time or before have expired.
    pub ended_before: i64,
    /// Ids of what was removed at this time or before are forgotten.
    pub forget_before: i64,
    /// Most jobs to remove.
    pub jobs: u32,
}

/// Statistics of a job table.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// Number of jobs in each state; every state is there.
    pub jobs: BTreeMap<State, u64>,
    /// Time of submission of the oldest queued job, epoch milliseconds.
    pub oldest_queued_at: Option<i64>,
    /// Mean expected solve time of queued jobs in µs; of a long queue, of some of them.
    pub mean_cost_us: f64,
    /// Size of the database file and its write-ahead log.
    pub database_bytes: u64,
    /// Size of the results outside the table.
    pub result_bytes: u64,
}

/// What a tenant has in a job table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Usage {
    /// Number of jobs and of chunks of runs in each state; a state may be missing.
    pub jobs: BTreeMap<State, u64>,
    /// Places in the queue that are reserved for batches that are being received.
    pub reserved: u64,
    /// Bytes that these stand for.
    pub staged_bytes: u64,
    /// Bytes of cases, templates and results that are stored.
    pub stored_bytes: u64,
}

/// Jobs whose deadline has passed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Overdue {
    /// Those that were queued and have been ended.
    pub ended: Vec<Uuid>,
    /// Those that are running.
    pub running: Vec<Uuid>,
}
