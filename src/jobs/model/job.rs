//! A job: its identity, its states and the transitions between them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::error::SolveError;
use crate::contact::remark::entry::RemarkEntry;
use crate::jobs::model::kind::Kind;
use crate::jobs::model::submit_options::Priority;

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
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// The batch it belongs to, if it was submitted in one.
    pub batch_id: Option<Uuid>,
    /// Its place among the queued jobs of the tenant.
    pub priority: Priority,
    /// Time of submission.
    pub created_at: i64,
    /// Time of the last change, progress aside.
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
    /// What the client should know before using the numbers; filled on success.
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

/// Where a queued job stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct QueuePlace {
    /// Jobs of the tenant that come before it.
    pub position: u32,
    /// Expected time until it is begun, in s, from the estimated costs of those before it and the turns of other tenants; rough.
    pub starts_in_s: f64,
}

/// Where a job stands.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
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

names! {
    pub FailureKind {
        NotConverged = "not_converged",
        Unsolvable = "unsolvable",
        OutOfTime = "out_of_time",
        DeadlinePassed = "deadline_passed",
        Panic = "panic",
        WorkerLost = "worker_lost",
        Internal = "internal",
    }
}

names! {
    pub State {
        Queued = "queued",
        Running = "running",
        Succeeded = "succeeded",
        Failed = "failed",
        Cancelled = "cancelled",
    }
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

#[cfg(test)]
mod tests {
    use super::*;

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
