//! Jobs, batches, keys, and how they are submitted.
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use railhead_macros::Names;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use railhead_contact::error::SolveError;
use railhead_contact::remark::entry::RemarkEntry;

/// A kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Names)]
pub enum Kind {
    /// One case: a job.
    #[default]
    Case,
    /// Many cases: a batch, each case of which is a job.
    Cases,
    /// Many rows over one case: a run, which is solved in chunks of rows.
    Rows,
    /// Profiles that wear step by step: one job, whose slices are steps.
    Evolution,
}

impl Kind {
    /// What clients call work of this kind.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Kind::Case => "job",
            Kind::Cases => "batch",
            Kind::Rows => "run",
            Kind::Evolution => "evolution",
        }
    }

    /// The same in the plural, also the name of the resource.
    #[must_use]
    pub fn nouns(self) -> &'static str {
        match self {
            Kind::Case => "jobs",
            Kind::Cases => "batches",
            Kind::Rows => "runs",
            Kind::Evolution => "evolutions",
        }
    }

    /// The kind of a single job of this work.
    #[must_use]
    pub fn of_job(self) -> Kind {
        match self {
            Kind::Case | Kind::Cases => Kind::Case,
            Kind::Rows => Kind::Rows,
            Kind::Evolution => Kind::Evolution,
        }
    }
}

/// A queue of jobs. The jobs of a tenant, the chunks of its runs and its evolutions wait in one each, so that none holds up the others.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Queue {
    /// The tenant.
    pub tenant: Arc<str>,
    /// [`Kind::Case`], [`Kind::Rows`] or [`Kind::Evolution`].
    pub kind: Kind,
}

/// Labels that a key is bound to: it opens only what carries them, and what it makes gets them.
pub type Labels = BTreeMap<String, String>;

/// Most labels that a key may be bound to.
pub const BOUND_MAX: usize = 8;

/// The tenant of requests without a key.
pub const ANONYMOUS: &str = "anonymous";

/// The tenant whose keys may read the metrics of the whole service.
pub const OPERATOR: &str = "operator";

/// Longest name of a tenant in characters.
const TENANT_MAX_CHARS: usize = 64;

/// What every key begins with, so that scanners for leaked secrets recognise it.
pub(crate) const MARK: &str = "rh_";

/// What is kept of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The part of the key that is no secret; names it in lists and logs.
    pub id: String,
    /// BLAKE3 of the whole key. A key is 256 random bits, so a fast hash is enough.
    pub hash: blake3::Hash,
    /// Whose jobs it opens.
    pub tenant: Arc<str>,
    /// What it is for, in the operator's words.
    pub name: Option<String>,
    /// Time of creation, epoch milliseconds.
    pub created_at: i64,
    /// Time since which it is refused.
    pub revoked_at: Option<i64>,
    /// It reads what is the tenant's, and changes nothing.
    pub read_only: bool,
    /// It opens only what carries these labels, and gives them to what it makes; everything of the tenant without any.
    pub labels: Arc<Labels>,
}

/// Keys found good, with the time at which they were looked up.
pub(crate) type Trusted = std::collections::HashMap<String, (Key, Instant)>;

/// 1 to 64 letters, digits, dots, dashes and underscores.
pub(crate) fn is_tenant(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    (1..=TENANT_MAX_CHARS).contains(&name.len()) && name.bytes().all(allowed)
}

/// Order among the tenant's queued jobs. It has no effect between tenants, which take turns.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, ToSchema, Names,
)]
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
    /// Priority among the tenant's queued jobs.
    pub priority: Priority,
    /// Time after the submission within which it must have ended; `None`: it may take any time.
    pub ends_within: Option<Duration>,
    /// It is solved even if an identical case was solved before.
    pub bypass_cache: bool,
}

/// The options of a submission.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WorkOptions {
    /// Free text of the client; that of a single case is in the case.
    pub name: Option<String>,
    /// Labels of the client; those of a single case are in the case.
    pub labels: Labels,
    /// Priority, deadline and use of earlier results.
    pub submit: SubmitOptions,
    /// The client's idempotency key.
    pub idempotency_key: Option<String>,
}

impl From<SubmitOptions> for WorkOptions {
    fn from(submit: SubmitOptions) -> WorkOptions {
        WorkOptions {
            submit,
            ..WorkOptions::default()
        }
    }
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

/// What is known of one job. Times are epoch milliseconds (UTC).
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// UUIDv7; sorts by time of submission.
    pub id: Uuid,
    /// Whose it is.
    pub tenant: String,
    /// [`Kind::Case`], [`Kind::Evolution`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// Where it stands.
    pub state: State,
    /// Free text given by the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// The batch it belongs to, if it was submitted in one.
    pub batch_id: Option<Uuid>,
    /// Priority among the tenant's queued jobs.
    pub priority: Priority,
    /// Time of submission.
    pub created_at: i64,
    /// Time of the last change, except changes of progress.
    pub updated_at: i64,
    /// Start of the current or last attempt; absent while queued.
    pub started_at: Option<i64>,
    /// End of the job; absent before it.
    pub ended_at: Option<i64>,
    /// When it must have ended; it fails if it has not.
    pub deadline: Option<i64>,
    /// When it will be removed with its result; absent before its end, and where ended jobs are kept for ever.
    pub expires_at: Option<i64>,
    /// Attempts that count, from 1 once running, since the last slice was stored; one handed back by a graceful shutdown does
    /// not count.
    pub attempt: u32,
    /// 0 to 1, rough; written at most with each heartbeat.
    pub progress: f64,
    /// What the client should know before using the numbers; filled when it succeeds or fails.
    pub remarks: Vec<RemarkEntry>,
    /// Why there is no answer; present exactly when the state is `failed`.
    pub failure: Option<Failure>,
    /// The result was computed for an identical case before, not for this job.
    pub cached: bool,
    /// Grows with every change that a client can see.
    pub version: u64,
    /// Its place in the queue; only filled for a queued job that is read by itself.
    pub queue: Option<QueuePlace>,
}

/// Position of a job in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct QueuePlace {
    /// Number of jobs of the tenant before it.
    pub position: u32,
    /// Expected time in s until the job starts, from the estimated costs of the jobs before it and the turns of other tenants; rough.
    pub starts_in_s: f64,
}

/// State of a job.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    ToSchema,
    Names,
)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Waits for a worker.
    Queued,
    /// A worker is on it.
    Running,
    /// Ended with an answer.
    Succeeded,
    /// Ended without an answer.
    Failed,
    /// Ended because the client asked for it.
    Cancelled,
}

/// Why a job has no answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// The kind of failure.
    pub kind: FailureKind,
    /// What happened, as a sentence.
    pub detail: String,
    /// Residual of the best iterate, relative to the traction scale of the case, where a solve did not converge.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub residual: Option<f64>,
    /// Iterations done, where a solve did not converge.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub iterations: Option<u32>,
    /// JSON pointer to the part of the case that allows no answer, where one part does.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pointer: Option<String>,
}

/// The kinds of failure a client can meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Names)]
#[serde(rename_all = "snake_case")]
pub enum FailureKind {
    /// The iteration ended without meeting its tolerance.
    NotConverged,
    /// The contact has no solution that the method could find; the detail says why.
    Unsolvable,
    /// The time limit of the case was reached.
    OutOfTime,
    /// The deadline that the client set for the job passed before its end.
    DeadlinePassed,
    /// The solver panicked; the fault is ours.
    Panic,
    /// Every allowed attempt ended with the loss of its worker.
    WorkerLost,
    /// The service could not do its part, for example store the result.
    Internal,
}

impl State {
    /// Nothing will change any more.
    #[must_use]
    pub fn ended(self) -> bool {
        matches!(self, State::Succeeded | State::Failed | State::Cancelled)
    }

    /// May a job move from this state to `next`? An ended job never moves again.
    #[must_use]
    pub fn may_become(self, next: State) -> bool {
        match self {
            State::Queued => matches!(next, State::Running | State::Failed | State::Cancelled),
            State::Running => next != State::Running,
            State::Succeeded | State::Failed | State::Cancelled => false,
        }
    }
}

impl Failure {
    /// A failure without numbers.
    #[must_use]
    pub fn new(kind: FailureKind, detail: impl Into<String>) -> Failure {
        Failure {
            kind,
            detail: detail.into(),
            residual: None,
            iterations: None,
            pointer: None,
        }
    }

    /// Every allowed attempt lost its worker.
    #[must_use]
    pub fn worker_lost(attempts_max: u32) -> Failure {
        Failure::new(
            FailureKind::WorkerLost,
            format!("the worker was lost on every one of the {attempts_max} allowed attempts"),
        )
    }

    /// The failure a solver error stands for; a cancelled solve is no failure.
    #[must_use]
    pub fn of_solve(error: &SolveError) -> Option<Failure> {
        match error {
            SolveError::Cancelled => None,
            SolveError::OutOfTime { .. } => {
                Some(Failure::new(FailureKind::OutOfTime, error.to_string()))
            }
            SolveError::RoughProfile { pointer, .. } => Some(Failure {
                pointer: Some(pointer.clone()),
                ..Failure::new(FailureKind::Unsolvable, error.to_string())
            }),
            SolveError::Unmeshable { .. }
            | SolveError::NormalProblem { .. }
            | SolveError::NotCovered { .. }
            | SolveError::NotFinite { .. } => {
                Some(Failure::new(FailureKind::Unsolvable, error.to_string()))
            }
            SolveError::NotConverged {
                residual,
                iterations,
                ..
            } => Some(Failure {
                kind: FailureKind::NotConverged,
                detail: error.to_string(),
                residual: Some(*residual),
                iterations: Some(u32::try_from(*iterations).unwrap_or(u32::MAX)),
                pointer: None,
            }),
        }
    }
}

/// The time of submission is the one inside the id, so that order by id is order by time.
pub(crate) fn created_at(id: Uuid) -> i64 {
    i64::try_from(id.as_u128() >> 80).unwrap_or(0)
}

/// The failure of a job that had not ended by its deadline.
pub(crate) fn too_late() -> Failure {
    Failure::new(
        FailureKind::DeadlinePassed,
        "the deadline of the job passed before it had ended",
    )
}

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
    /// Number of faulty cases that were skipped.
    pub rejected: u32,
    /// Free text given by the client.
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

/// The stored record of a run, without its chunks.
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
    /// Index of the case in the request, from 0.
    pub index: u32,
    /// The job.
    pub job: Job,
    /// The outputs the case asks for, as the JSON list of their names.
    pub outputs: String,
    /// What there is to show; `None` until the job has succeeded.
    pub result: Option<ItemResult>,
}

impl BatchItem {
    /// The key of a result that lies outside the table.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        match &self.result {
            Some(ItemResult::Stored(key)) => Some(key),
            _ => None,
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_tenants_are_plain() {
        for good in ["a", "Network-Rail_2.north", &"x".repeat(64)] {
            assert!(is_tenant(good), "{good}");
        }
        for bad in ["", "a b", "ä", "a/b", "a\n", &"x".repeat(65)] {
            assert!(!is_tenant(bad), "{bad:?}");
        }
    }

    #[test]
    fn names_of_states_come_back_as_states() {
        for state in State::ALL {
            assert_eq!(State::from_name(state.name()), Some(state));
            assert_eq!(serde_json::to_value(state).unwrap(), state.name());
        }
        assert_eq!(State::from_name("canceled"), None);
        for kind in FailureKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
    }

    #[test]
    fn an_ended_job_never_moves_again() {
        for from in State::ALL {
            for to in State::ALL {
                if from.ended() {
                    assert!(!from.may_become(to), "{from:?} must not become {to:?}");
                }
            }
        }
        assert!(State::Queued.may_become(State::Running));
        assert!(State::Running.may_become(State::Queued));
        assert!(!State::Queued.may_become(State::Succeeded));
    }

    #[test]
    fn a_failure_survives_the_database_form() {
        let failure = Failure {
            residual: Some(3.5e-4),
            iterations: Some(40),
            ..Failure::new(FailureKind::NotConverged, "no convergence")
        };
        let text = serde_json::to_string(&failure).unwrap();
        assert_eq!(serde_json::from_str::<Failure>(&text).unwrap(), failure);
    }
}
