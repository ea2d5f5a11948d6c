//! The body of a failure as the client reads it, in an answer or inside a job (RFC 9457).

use std::borrow::Cow;

use railhead_macros::none_is_absent;
use serde::Serialize;
use serde_json::{Number, Value};
use utoipa::ToSchema;

use crate::contact::error::{Fault as CaseFault, FaultCode};
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::model::job::{Failure, FailureKind, Job};

/// A failure as the client reads it (RFC 9457).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Problem)]
pub(crate) struct ProblemBody {
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
#[none_is_absent]
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct Fault {
    /// JSON pointer (RFC 6901) into the body; empty for the body as a whole.
    #[schema(example = "/material/poisson_ratio")]
    #[schema(nullable = true)]
    pub pointer: Option<String>,
    /// Name of a query parameter.
    #[schema(nullable = true)]
    pub parameter: Option<String>,
    /// Name of a request header.
    #[schema(nullable = true)]
    pub header: Option<String>,
    /// Line of the body that holds the faulty case of a batch, counted from 1; only of NDJSON.
    #[schema(nullable = true)]
    pub line: Option<u64>,
    /// Kind of the fault: `invalid` where only `detail` tells more, else `missing`, `unknown-member`, `wrong-type`, `out-of-range`,
    /// `unknown-word`, `too-long`, `unknown-parameter`, or `repeated`. There may be more.
    #[schema(example = "out-of-range")]
    pub code: Cow<'static, str>,
    /// The value given and what is allowed.
    pub detail: String,
    /// The value given, where it is no array, no object and no long text.
    #[schema(value_type = Option<Value>)]
    #[schema(nullable = true)]
    pub value: Option<Value>,
    /// Smallest number allowed.
    #[schema(value_type = Option<f64>)]
    pub minimum: Option<Number>,
    /// The smallest number itself is not allowed; absent if it is.
    pub minimum_excluded: Option<bool>,
    /// Largest number, or number of characters, allowed.
    #[schema(value_type = Option<f64>)]
    pub maximum: Option<Number>,
    /// Unit of these numbers.
    #[schema(value_type = Option<String>)]
    pub unit: Option<&'static str>,
    /// The words that are allowed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub allowed: Vec<String>,
}

impl Fault {
    /// A fault of a query parameter.
    #[must_use]
    pub fn parameter(name: &str, detail: impl Into<String>) -> Self {
        Fault {
            parameter: Some(name.to_owned()),
            ..Fault::invalid(detail)
        }
    }

    /// A fault of which no more is known than the sentence; where it is has to be filled in.
    #[must_use]
    pub fn invalid(detail: impl Into<String>) -> Self {
        Fault {
            code: FaultCode::default().name().into(),
            detail: detail.into(),
            ..Fault::default()
        }
    }
}

impl From<CaseFault> for Fault {
    fn from(fault: CaseFault) -> Self {
        let figures = *fault.figures;
        Fault {
            pointer: Some(fault.pointer),
            code: figures.code.name().into(),
            value: figures.value,
            minimum: figures.minimum,
            minimum_excluded: figures.minimum_excluded.then_some(true),
            maximum: figures.maximum,
            unit: figures.unit,
            allowed: figures.allowed,
            ..Fault::invalid(fault.detail)
        }
    }
}

impl ProblemBody {
    /// A problem of this kind with a sentence about this occurrence.
    #[must_use]
    pub(crate) fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
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
    pub(crate) fn of_job(job: &Job, failure: &Failure) -> Self {
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
                ..Fault::invalid(failure.detail.clone())
            }));
        problem
    }
}
