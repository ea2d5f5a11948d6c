//! Data types of jobs, batches, runs and API keys, and the options of a submission.
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use railhead_macros::{Names, keyword};
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
    /// Many cases: a batch. Each case is a job.
    Cases,
    /// Many rows over one case: a run, which is solved in chunks of rows.
    Rows,
    /// Profiles that wear step by step: one job, whose slices are steps.
    Evolution,
}

impl Kind {
    /// The noun for one piece of work of this kind in messages.
    #[must_use]
    pub fn noun(self) -> &'static str {
        match self {
            Kind::Case => "job",
            Kind::Cases => "batch",
            Kind::Rows => "run",
            Kind::Evolution => "evolution",
        }
    }

    /// The plural of [`Kind::noun`], which is also the name of the resource.
    #[must_use]
    pub fn nouns(self) -> &'static str {
        match self {
            Kind::Case => "jobs",
            Kind::Cases => "batches",
            Kind::Rows => "runs",
            Kind::Evolution => "evolutions",
        }
    }

    /// The kind of the jobs that work of this kind consists of.
    #[must_use]
    pub fn of_job(self) -> Kind {
        match self {
            Kind::Case | Kind::Cases => Kind::Case,
            Kind::Rows => Kind::Rows,
            Kind::Evolution => Kind::Evolution,
        }
    }
}

/// A queue of jobs. Each tenant has one queue per kind, so that work of one kind does not delay the others.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Queue {
    /// The tenant.
    pub tenant: Arc<str>,
    /// [`Kind::Case`], [`Kind::Rows`] or [`Kind::Evolution`].
    pub kind: Kind,
}

/// Labels of work. An API key may be restricted to work with certain labels.
pub type Labels = BTreeMap<String, String>;

/// The largest number of labels of a key.
pub const BOUND_MAX: usize = 8;

/// The tenant of requests without a key.
pub const ANONYMOUS: &str = "anonymous";

/// The tenant whose keys may read the metrics of the whole service.
pub const OPERATOR: &str = "operator";

/// The greatest length of a tenant name in characters.
const TENANT_MAX_CHARS: usize = 64;

/// The prefix of every key, by which scanners for leaked secrets recognise it.
pub(crate) const KEY_PREFIX: &str = "rh_";

/// An API key as it is stored, without its secret.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The public part of the key, which names it in lists and logs.
    pub id: String,
    /// BLAKE3 of the whole key. A key is 256 random bits, so a fast hash is enough.
    pub hash: blake3::Hash,
    /// The tenant whose work the key gives access to.
    pub tenant: Arc<str>,
    /// The purpose, as given by the operator.
    pub name: Option<String>,
    /// Time of creation, epoch milliseconds.
    pub created_at: i64,
    /// Time of revocation, epoch milliseconds; `None` while the key is valid.
    pub revoked_at: Option<i64>,
    /// Whether the key may only read.
    pub read_only: bool,
    /// Labels that restrict the key: it sees only work with these labels, and its submissions get them. Empty: no restriction.
    pub labels: Arc<Labels>,
}

/// Recently validated keys by id, with the time of the lookup.
pub(crate) type Trusted = std::collections::HashMap<String, (Key, Instant)>;

/// Whether a text is a valid tenant name: 1 to 64 letters, digits, dots, dashes and underscores.
pub(crate) fn is_tenant(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    (1..=TENANT_MAX_CHARS).contains(&name.len()) && name.bytes().all(allowed)
}

/// Order among the tenant's queued jobs. It has no effect between tenants, which take turns.
#[keyword(Hash, Default, Names)]
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
    /// The rank in the database, which is the index in [`Priority::ALL`].
    pub(crate) fn rank(self) -> i64 {
        self as i64
    }

    pub(crate) fn from_rank(rank: usize) -> Option<Priority> {
        Priority::ALL.get(rank).copied()
    }
}

/// Options of a submission: of one job, or of all jobs of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SubmitOptions {
    /// Priority among the tenant's queued jobs.
    pub priority: Priority,
    /// Time after the submission within which the job must end; `None`: no deadline.
    pub ends_within: Option<Duration>,
    /// Whether to solve the case even if the result of an identical case is stored.
    pub bypass_cache: bool,
}

/// All options of a submission.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WorkOptions {
    /// Name given by the client. The name of a single case is part of the case.
    pub name: Option<String>,
    /// Labels given by the client. The labels of a single case are part of the case.
    pub labels: Labels,
    /// Priority, deadline and use of stored results.
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

/// Options of one case of a batch, which replace those of the batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CaseOptions {
    /// Replaces [`SubmitOptions::priority`].
    pub priority: Option<Priority>,
    /// Replaces [`SubmitOptions::ends_within`], in s.
    pub deadline_s: Option<u32>,
}

impl SubmitOptions {
    /// The options of one case of a batch.
    #[must_use]
    pub fn of_case(self, own: CaseOptions) -> SubmitOptions {
        let within = |seconds: u32| Duration::from_secs(seconds.into());
        SubmitOptions {
            priority: own.priority.unwrap_or(self.priority),
            ends_within: own.deadline_s.map(within).or(self.ends_within),
            bypass_cache: self.bypass_cache,
        }
    }

    /// The digest of a submission for its idempotency key: of the digest `asked` of the request, and of these options.
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

/// A job as it is stored. Times are epoch milliseconds (UTC).
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// UUIDv7, which sorts by time of submission.
    pub id: Uuid,
    /// The tenant that owns the job.
    pub tenant: String,
    /// [`Kind::Case`], [`Kind::Evolution`], or [`Kind::Rows`] for a chunk of a run.
    pub kind: Kind,
    /// State of the job.
    pub state: State,
    /// Name given by the client.
    pub name: Option<String>,
    /// Labels given by the client.
    pub labels: BTreeMap<String, String>,
    /// The batch or run that the job belongs to; `None` if it was submitted alone.
    pub batch_id: Option<Uuid>,
    /// Priority among the tenant's queued jobs.
    pub priority: Priority,
    /// Time of submission.
    pub created_at: i64,
    /// Time of the last change, not counting progress.
    pub updated_at: i64,
    /// Start of the current or last attempt; `None` while queued.
    pub started_at: Option<i64>,
    /// Time at which the job ended; `None` before.
    pub ended_at: Option<i64>,
    /// Deadline: the job fails if it has not ended by this time.
    pub deadline: Option<i64>,
    /// Time at which the job and its result are removed; `None` before its end, and if ended jobs are kept forever.
    pub expires_at: Option<i64>,
    /// Number of attempts since the last stored slice, at least 1 once running. Attempts that a graceful shutdown returned
    /// do not count.
    pub attempt: u32,
    /// Estimated progress from 0 to 1, written at most with each heartbeat.
    pub progress: f64,
    /// Remarks that matter for the use of the result; set when the job succeeds or fails.
    pub remarks: Vec<RemarkEntry>,
    /// Reason of the failure; present exactly if the state is `failed`.
    pub failure: Option<Failure>,
    /// Whether the result was computed for an earlier identical case.
    pub cached: bool,
    /// Increases with every change that clients can see.
    pub version: u64,
    /// Position in the queue; set only for a queued job that is read individually.
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
#[keyword(PartialOrd, Ord, Hash, Names)]
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

/// The reason why a job has no result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// The kind of failure.
    pub kind: FailureKind,
    /// Description as a sentence.
    pub detail: String,
    /// Residual of the best iterate relative to the traction scale of the case, if the solve did not converge.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub residual: Option<f64>,
    /// Number of iterations, if the solve did not converge.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub iterations: Option<u32>,
    /// JSON pointer to the part of the case that caused the failure, if there is one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub pointer: Option<String>,
}

/// The kinds of failure a client can meet.
#[keyword(Names)]
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
    /// Whether the state is final.
    #[must_use]
    pub fn ended(self) -> bool {
        matches!(self, State::Succeeded | State::Failed | State::Cancelled)
    }

    /// Whether a job may change from this state to `next`. A final state never changes.
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
    /// Creates a failure of this kind.
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

    /// The failure of a job that lost its worker in each allowed attempt.
    #[must_use]
    pub fn worker_lost(attempts_max: u32) -> Failure {
        Failure::new(
            FailureKind::WorkerLost,
            format!("the worker was lost on every one of the {attempts_max} allowed attempts"),
        )
    }

    /// The failure that corresponds to a solver error; `None` for a cancelled solve.
    #[must_use]
    pub fn of_solve(error: &SolveError) -> Option<Failure> {
        let mut failure = Failure::new(FailureKind::Unsolvable, error.to_string());
        match error {
            SolveError::Cancelled => return None,
            SolveError::OutOfTime { .. } => failure.kind = FailureKind::OutOfTime,
            SolveError::RoughProfile { pointer, .. } => failure.pointer = Some(pointer.clone()),
            SolveError::NotConverged {
                residual,
                iterations,
                ..
            } => {
                failure.kind = FailureKind::NotConverged;
                failure.residual = Some(*residual);
                failure.iterations = Some(u32::try_from(*iterations).unwrap_or(u32::MAX));
            }
            SolveError::Unmeshable { .. }
            | SolveError::NormalProblem { .. }
            | SolveError::NotCovered { .. }
            | SolveError::NotFinite { .. } => {}
        }
        Some(failure)
    }
}

/// The time of submission, which is the leading part of an id: order by id is order by time.
pub(crate) fn created_at(id: Uuid) -> i64 {
    i64::try_from(id.as_u128() >> 80).unwrap_or(0)
}

/// The failure of a job that passed its deadline.
pub(crate) fn too_late() -> Failure {
    Failure::new(
        FailureKind::DeadlinePassed,
        "the deadline of the job passed before it had ended",
    )
}

/// A batch or run as it is stored, with the number of its jobs by state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// UUIDv7.
    pub id: Uuid,
    /// The tenant that owns it.
    pub tenant: String,
    /// [`Kind::Cases`], or [`Kind::Rows`] for a run, whose jobs are chunks of rows.
    pub kind: Kind,
    /// Time of submission, epoch milliseconds.
    pub created_at: i64,
    /// Number of jobs at submission.
    pub count: u32,
    /// Number of invalid cases that were skipped.
    pub rejected: u32,
    /// Name given by the client.
    pub name: Option<String>,
    /// Labels given by the client.
    pub labels: BTreeMap<String, String>,
    /// Time at which the last of its ended jobs ended, epoch milliseconds.
    pub last_ended_at: Option<i64>,
    /// Number of jobs by state; contains every state.
    pub states: BTreeMap<State, u64>,
}

impl Batch {
    /// Number of jobs in a state.
    #[must_use]
    pub fn in_state(&self, state: State) -> u64 {
        self.states.get(&state).copied().unwrap_or(0)
    }

    /// Number of ended jobs, and of all jobs that still exist.
    #[must_use]
    pub fn ended(&self) -> (u64, u64) {
        let ended = self.states.iter().filter(|(state, _)| state.ended());
        (
            ended.map(|(_, jobs)| jobs).sum(),
            self.states.values().sum(),
        )
    }

    /// A text that differs between any two states of the batch that clients can distinguish.
    #[must_use]
    pub fn change_tag(&self) -> String {
        let counts: Vec<String> = self.states.values().map(ToString::to_string).collect();
        counts.join("-")
    }
}

/// The stored record of a run, without its chunks.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// The template as stored.
    pub template: Bytes,
    /// The part of the head that is specific to the run; `None` in the first format, whose template contains everything.
    pub head: Option<Bytes>,
    /// Number of rows without an answer in succeeded chunks.
    pub without_answer: u64,
    /// Whether the last chunk, which may be smaller, failed or was cancelled.
    pub last_lost: bool,
    /// Sum of the progress of running chunks.
    pub running: f64,
}

/// A job of a batch with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchItem {
    /// Index of the case in the request, from 0.
    pub index: u32,
    /// The job.
    pub job: Job,
    /// The requested outputs as a JSON list of names.
    pub outputs: String,
    /// The solution as JSON text, if the job has succeeded and the result is small.
    pub solution: Option<Bytes>,
    /// The key of a large result, which `Jobs::open_item` reads.
    pub key: Option<String>,
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
