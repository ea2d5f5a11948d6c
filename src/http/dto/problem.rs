//! The body of a failure as the client reads it, in an answer or inside a job (RFC 9457).

use serde::Serialize;
use utoipa::ToSchema;

use crate::http::problem::kinds::ProblemKind;
use crate::jobs::model::{Failure, FailureKind, Job};

/// A failure as the client reads it (RFC 9457).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Problem)]
pub struct ProblemBody {
    /// Address of the kind of problem, relative to this service; it answers with an explanation.
    #[serde(rename = "type")]
    #[schema(example = "/problems/faulty-case")]
    pub kind: String,
    /// The kind of problem in a few words.
    pub title: String,
    /// HTTP status code. Inside a job: the one that describes the failure best.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// What happened this time: what was given and what is allowed.
    pub detail: String,
    /// Path of the resource that the request was for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instance: Option<String>,
    /// Every fault found, not only the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub errors: Vec<Fault>,
    /// Line of malformed JSON, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Column of malformed JSON, counted from 1; 0 at the start of a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<usize>,
    /// Best residual of a solve that did not converge, relative to the traction scale of the case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// Iterations of a solve that did not converge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<u32>,
}

/// One fault of a request. Exactly one of `pointer`, `parameter` and `header` says where it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Fault {
    /// JSON pointer (RFC 6901) into the body; empty for the body as a whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "/material/poisson_ratio")]
    pub pointer: Option<String>,
    /// Name of a query parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameter: Option<String>,
    /// Name of a request header.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub header: Option<String>,
    /// Line of the body that holds the faulty case of a batch, counted from 1; only of NDJSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// The value given and what is allowed.
    pub detail: String,
}

impl Fault {
    /// A fault of a query parameter.
    #[must_use]
    pub fn parameter(name: &str, detail: impl Into<String>) -> Self {
        Fault {
            pointer: None,
            parameter: Some(name.to_owned()),
            header: None,
            line: None,
            detail: detail.into(),
        }
    }
}

impl ProblemBody {
    /// A problem of this kind with a sentence about this occurrence.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        ProblemBody {
            kind: format!("/problems/{}", kind.slug()),
            title: kind.title().to_owned(),
            status: kind.status(),
            detail: detail.into(),
            instance: None,
            errors: Vec::new(),
            line: None,
            column: None,
            residual: None,
            iterations: None,
        }
    }

    /// The reason why a job failed, as the job shows it.
    #[must_use]
    pub fn of_job(job: &Job, failure: &Failure) -> Self {
        let kind = match failure.kind {
            FailureKind::NotConverged => ProblemKind::NotConverged,
            FailureKind::Unsolvable => ProblemKind::Unsolvable,
            FailureKind::OutOfTime => ProblemKind::OutOfTime,
            FailureKind::DeadlinePassed => ProblemKind::DeadlinePassed,
            FailureKind::Panic => ProblemKind::SolverPanic,
            FailureKind::WorkerLost => ProblemKind::WorkerLost,
            FailureKind::Internal => ProblemKind::Internal,
        };
        let mut problem = ProblemBody::new(kind, failure.detail.clone());
        problem.instance = Some(format!("/v1/jobs/{}", job.id));
        problem.residual = failure.residual;
        problem.iterations = failure.iterations;
        problem
            .errors
            .extend(failure.pointer.as_ref().map(|pointer| Fault {
                pointer: Some(pointer.clone()),
                parameter: None,
                header: None,
                line: None,
                detail: failure.detail.clone(),
            }));
        problem
    }
}
