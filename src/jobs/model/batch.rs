//! Batches and runs, and their jobs, as clients read them.

use std::collections::BTreeMap;

use bytes::Bytes;
use uuid::Uuid;

use crate::jobs::model::job::{Job, State};
use crate::jobs::model::kind::Kind;

/// What is known of one batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// UUIDv7.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: String,
    /// [`Kind::Cases`], or [`Kind::Rows`]: a run, whose jobs are its chunks.
    pub kind: Kind,
    /// Time of submission, epoch milliseconds.
    pub created_at: i64,
    /// Number of jobs it was made of.
    pub count: u32,
    /// Number of faulty cases that were left out.
    pub rejected: u32,
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// When the last of its jobs that have ended did so, epoch milliseconds.
    pub last_ended_at: Option<i64>,
    /// Number of jobs in each state; every state is there.
    pub states: BTreeMap<State, u64>,
}

impl Batch {
    /// Number of jobs in a state.
    #[must_use]
    pub fn in_state(&self, state: State) -> u64 {
        self.states.get(&state).copied().unwrap_or(0)
    }

    /// Number of jobs that have ended, and of all jobs that are still there.
    #[must_use]
    pub fn ended(&self) -> (u64, u64) {
        let ended = self.states.iter().filter(|(state, _)| state.ended());
        (
            ended.map(|(_, jobs)| jobs).sum(),
            self.states.values().sum(),
        )
    }
}

/// What is kept of a run beside its chunks.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Its template, as stored.
    pub template: Bytes,
    /// Its own part of what its chunks share, as stored; none in the first form, whose template has all.
    pub head: Option<Bytes>,
    /// Rows of ended chunks that have no answer.
    pub without_answer: u64,
    /// Sum of the progress of the chunks that are being solved.
    pub running: f64,
}

/// One job of a batch with what is needed to show its result.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchItem {
    /// Place of the case in what was sent, counted from 0.
    pub index: u32,
    /// The job.
    pub job: Job,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
    /// What there is to show; `None` until the job has succeeded.
    pub result: Option<ItemResult>,
}

/// The result of one job of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ItemResult {
    /// The solution as JSON text: a small one.
    Solution(Bytes),
    /// It lies under this key and is read by `Jobs::open_item`.
    Stored(String),
}

/// Why the result of a job of a batch cannot be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ItemFault {
    /// It was removed while the lines were read: the job has expired or was deleted.
    Gone,
    /// It cannot be read.
    Unreadable,
}

impl Batch {
    /// A short text that differs between any two states of the batch that a client can tell apart.
    #[must_use]
    pub fn change_tag(&self) -> String {
        let counts: Vec<String> = self.states.values().map(ToString::to_string).collect();
        counts.join("-")
    }
}
