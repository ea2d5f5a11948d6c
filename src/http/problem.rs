//! Problems (RFC 9457): their kinds, their form, and the conversion of errors.

use std::borrow::Cow;
use std::collections::BTreeMap;

use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use railhead_macros::none_is_absent;
use serde::Serialize;
use serde_json::{Number, Value};
use utoipa::ToSchema;
use utoipa::openapi::schema::Type;
use utoipa::openapi::{ContentBuilder, HeaderBuilder, ObjectBuilder, Ref, RefOr, ResponseBuilder};

use railhead_contact::error::{CaseError, Fault as CaseFault, FaultCode};
use railhead_contact::evaluate::varied::column_pointer;
use railhead_jobs::StorageFault;
use railhead_jobs::error::JobsError;
use railhead_jobs::model::{Failure, FailureKind, Job, Kind, State};
use railhead_tables::error::TableError;

/// Declares the kinds of problems once: name, status, slug, title, meaning.
macro_rules! kinds {
    ($($kind:ident $status:literal $slug:literal $title:literal $meaning:literal)*) => {
        /// A kind of problem; its slug is the last part of the problem's `type`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ProblemKind { $(#[doc = $meaning] $kind,)* }

        impl ProblemKind {
            /// Every kind.
            pub const ALL: &[ProblemKind] = &[$(ProblemKind::$kind),*];

            /// Returns the last part of the problem's `type`.
            #[must_use]
            pub fn slug(self) -> &'static str { match self { $(ProblemKind::$kind => $slug),* } }

            /// Returns the problem's `title`.
            #[must_use]
            pub fn title(self) -> &'static str { match self { $(ProblemKind::$kind => $title),* } }

            /// Returns the meaning of this kind, with advice.
            #[must_use]
            pub fn meaning(self) -> &'static str { match self { $(ProblemKind::$kind => $meaning),* } }

            /// Returns the HTTP status code.
            #[must_use]
            pub fn status(self) -> u16 { match self { $(ProblemKind::$kind => $status),* } }
        }
    };
}

kinds! {
    MalformedJson 400 "malformed-json" "The JSON of the body cannot be read" "The body cannot be read as JSON; `line` and `column` give the position. Repeated members and numbers too large for a 64-bit float are refused too."
    BadQuery 400 "bad-query" "The query is not valid" "A query parameter is unknown, repeated or has a value that is not allowed; `errors` names every such parameter."
    BadHeader 400 "bad-header" "A header is not valid" "A request header has a value that is not allowed; `errors` names it."
    UnreadableBody 400 "unreadable-body" "The body could not be read" "The connection ended before the whole body had arrived."
    Unauthorized 401 "unauthorized" "An API key is required" "Requests must have the header `Authorization: Bearer` with an API key. The key is missing, unknown or revoked. The operator of the service creates keys."
    Forbidden 403 "forbidden" "This key may not do that" "The key is valid but does not permit this request: it is read-only, or it is bound to labels and the request concerns the whole tenant, or the request is reserved for the tenant `operator`."
    CrossSite 403 "cross-site" "Cross-site requests may not change anything" "Without an API key, web pages of other origins may not change anything. The operator can allow origins with `--cors-origin`."
    HostNotAllowed 403 "host-not-allowed" "The host name is not allowed" "Without an API key, the header `Host` must be an IP address, `localhost` or a name that the operator allows with `--allowed-host`."
    UnknownRoute 404 "unknown-route" "There is nothing at this address" "No resource has this path; `/openapi.json` lists all paths."
    JobNotFound 404 "job-not-found" "There is no such job" "No job has this id: it never existed here, or it was deleted."
    BatchNotFound 404 "batch-not-found" "There is no such batch" "No batch has this id: it never existed here, or it was deleted."
    RunNotFound 404 "run-not-found" "There is no such run" "No run has this id: it never existed here, or it was deleted."
    RowNotFound 404 "row-not-found" "There is no such row" "The run has no row with this index; rows are counted from 0 in the order of the request."
    ProfileNotFound 404 "profile-not-found" "There is no such profile" "The tenant has no profile with this digest: it was never stored, or it was deleted."
    OutputNotAsked 404 "output-not-asked" "This output was not requested" "The case did not request this output, so it was not computed; submit the case again with the output in `outputs`."
    MethodNotAllowed 405 "method-not-allowed" "This method is not allowed here" "The resource does not support this HTTP method; the header `Allow` lists the methods that it supports."
    NotAcceptable 406 "not-acceptable" "No acceptable format" "The header `Accept` excludes every format of this resource, or `format` names one that it does not have; the detail lists its formats. Most resources have `application/json` only."
    BodyTimeout 408 "body-timeout" "The body arrived too slowly" "The whole body did not arrive within the allowed time (60 s for one case), or a batch arrived at less than 1024 bytes per second."
    ResultNotReady 409 "result-not-ready" "The job has not ended" "The job is queued or running, so there is no result yet; ask again after `Retry-After` seconds, or submit with `Prefer: wait=N`."
    JobFailed 409 "job-failed" "The job failed" "The job ended without a result; its member `error` says why."
    JobCancelled 409 "job-cancelled" "The job was cancelled" "The job was cancelled before it had a result."
    JobNotEnded 409 "job-not-ended" "The job has not ended" "Only an ended job can be deleted; cancel it first."
    BatchNotEnded 409 "batch-not-ended" "The batch has not ended" "A batch can be deleted only after all of its jobs have ended; cancel it first."
    RunNotEnded 409 "run-not-ended" "The run has not ended" "A run can be deleted only after all of its rows are finished; cancel it first."
    Expired 410 "expired" "This has expired" "The job or batch existed, but its retention time is over (`expires_at` of a job); it was removed with its results. Its id is remembered for 30 days."
    BodyTooLarge 413 "body-too-large" "The body is too large" "The body exceeds the size limit for one case or for a batch, or a batch has too many cases, or its rows take longer to read or to evaluate than one request is allowed."
    UnsupportedMediaType 415 "unsupported-media-type" "The body is not declared as JSON" "A case is sent with `Content-Type: application/json`, a batch also with `application/x-ndjson`."
    UnsupportedEncoding 415 "unsupported-encoding" "The content encoding is not supported" "A body may be sent uncompressed or with `Content-Encoding: gzip` or `zstd`; `Accept-Encoding` of the response lists these encodings."
    FaultyCase 422 "faulty-case" "The case has faults" "The body is JSON but not a case that can be solved; `errors` lists every fault with its JSON pointer, the value given and what is allowed."
    FaultyBatch 422 "faulty-batch" "The batch has faults" "The body has no cases, or some of its cases have faults. `errors` lists every fault with a JSON pointer, which begins with the index of its case from 0, and with its line in NDJSON and CSV. Nothing was stored; with `?on_invalid=skip` the valid cases are accepted."
    FaultyTable 422 "faulty-table" "The header of the table has faults" "The first line of a table names its columns by JSON pointers such as `/load/normal_force_n`, by short names or by quantities with units. The detail names the faulty column and what is allowed; `errors`, if present, has one entry per faulty column."
    TooManyRequests 429 "too-many-requests" "Too many requests" "The key, or without one the address, exceeds its requests per second, or the tenant exceeds its number of concurrent requests, event streams or waits; the detail says which. Try again after `Retry-After` seconds."
    QuotaExceeded 429 "quota-exceeded" "Too many jobs are queued" "The tenant has reached its limit of queued jobs. Nothing was stored; try again after `Retry-After` seconds."
    StoredQuotaExceeded 507 "stored-quota-exceeded" "The storage quota of the tenant is used up" "The cases, templates and results of the tenant have reached their limit in bytes. Nothing was stored and nothing was removed. Delete ended jobs, batches or runs, then send the request again."
    ProfilesFull 429 "profiles-full" "The profile quota of the tenant is used up" "The profiles of the tenant have reached their limit in bytes; delete some, then send the request again."
    EvaluationTooLong 422 "evaluation-too-long" "The rows take too long for one request" "The rows need the solver, and exceed the time, the memory or the number of rows of one evaluation; the detail says which. Nothing was stored. Submit them to `/v1/runs`, which accepts the same body with any number of rows, or submit a single case to `/v1/jobs`."
    IdempotencyConflict 422 "idempotency-conflict" "The idempotency key belongs to another request" "The `Idempotency-Key` was used before with a different body, priority, deadline or `no-cache`; use a new key for a new request."
    Internal 500 "internal" "The service failed" "An internal error; the log of the service has the reason under the request id in the header `x-request-id`."
    QueueFull 503 "queue-full" "The queue is full" "The service has reached its limit of unfinished jobs. Nothing was stored; try again after `Retry-After` seconds."
    StorageUnwritable 503 "storage-unwritable" "The disk cannot be written" "The disk of the service is read-only or fails, or another process locks its job table. Nothing was stored; accepted jobs are kept. Try again after `Retry-After` seconds."
    StorageUnreachable 503 "storage-unreachable" "The storage cannot be reached" "The shared database or the store of the results does not respond or rejects writes. Nothing was stored; accepted jobs are kept. Try again after `Retry-After` seconds."
    StorageFull 507 "storage-full" "The disk is full" "The disk of the service has no space for another job. Nothing was stored; accepted jobs are kept. Try again after `Retry-After` seconds."
    Draining 503 "draining" "The service is shutting down" "The service is shutting down and accepts no new jobs; accepted jobs are kept. Try again after `Retry-After` seconds."
    Overloaded 503 "overloaded" "The service is overloaded" "The memory or the slots for requests of this kind are in use, or every connection has an active request. Nothing was done; try again after `Retry-After` seconds."
    NotReady 503 "not-ready" "The service is not ready" "The job store is currently unreachable."
    NotConverged 422 "not-converged" "The solver did not converge" "Only inside a job: the iteration ended without meeting its tolerance. `residual` and `iterations` belong to the best iterate; `detail` says what to try."
    Unsolvable 422 "unsolvable" "The contact has no solution" "Only inside a job: the region cannot be meshed or the contact does not exist; the detail says why."
    OutOfTime 422 "out-of-time" "The solve ran out of time" "Only inside a job: the solver used up `solver.time_limit_s` of the case."
    DeadlinePassed 422 "deadline-passed" "The deadline of the job has passed" "Only inside a job: the job did not end within `deadline_s` of the submission, so its solution was stopped."
    SolverPanic 500 "solver-panic" "The solver failed" "Only inside a job: the solver stopped on an internal error. Other jobs are not affected."
    WorkerLost 500 "worker-lost" "The workers of this job were lost" "Only inside a job: every worker that took the job ended without a result, up to the allowed number of attempts."
}

impl ProblemKind {
    /// Returns the problem of an unknown id of work of this kind.
    #[must_use]
    pub fn not_found(kind: Kind) -> ProblemKind {
        match kind {
            Kind::Case | Kind::Evolution => ProblemKind::JobNotFound,
            Kind::Cases => ProblemKind::BatchNotFound,
            Kind::Rows => ProblemKind::RunNotFound,
        }
    }

    /// Returns the problem of work of this kind that has not ended.
    #[must_use]
    pub fn not_ended(kind: Kind) -> ProblemKind {
        match kind {
            Kind::Case | Kind::Evolution => ProblemKind::JobNotEnded,
            Kind::Cases => ProblemKind::BatchNotEnded,
            Kind::Rows => ProblemKind::RunNotEnded,
        }
    }

    /// Whether the problem is temporary, so that the response has `Retry-After`.
    #[must_use]
    pub fn passes(self) -> bool {
        matches!(
            self,
            ProblemKind::ResultNotReady
                | ProblemKind::TooManyRequests
                | ProblemKind::QuotaExceeded
                | ProblemKind::QueueFull
                | ProblemKind::StorageUnwritable
                | ProblemKind::StorageUnreachable
                | ProblemKind::StorageFull
                | ProblemKind::Draining
                | ProblemKind::Overloaded
                | ProblemKind::NotReady
        )
    }
}

/// A failed request or job (RFC 9457).
#[none_is_absent(nullable)]
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
#[schema(as = Problem)]
pub(crate) struct ProblemBody {
    /// Path of the kind of problem on this service, which returns an explanation.
    #[serde(rename = "type")]
    #[schema(example = "/problems/faulty-case")]
    pub kind: String,
    /// The kind of problem in a few words.
    pub title: String,
    /// HTTP status code; inside a job, the code that describes the failure best.
    #[schema(minimum = 400, maximum = 599)]
    pub status: u16,
    /// What happened: the value given and what is allowed.
    pub detail: String,
    /// Path of the requested resource.
    pub instance: Option<String>,
    /// All faults found, not only the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub errors: Vec<Fault>,
    /// Line of malformed JSON, counted from 1.
    pub line: Option<usize>,
    /// Column of malformed JSON, counted from 1; 0 at the start of a line.
    pub column: Option<usize>,
    /// Best residual of a solve that did not converge, relative to the traction scale of the case.
    pub residual: Option<f64>,
    /// Iterations of a solve that did not converge.
    pub iterations: Option<u32>,
}

/// One fault of a request. Exactly one of `pointer`, `parameter` and `header` gives its location.
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
    /// Line of the body that contains the faulty case of a batch, counted from 1; only for NDJSON and CSV.
    #[schema(nullable = true)]
    pub line: Option<u64>,
    /// Kind of the fault: `missing`, `unknown-member`, `wrong-type`, `out-of-range`, `unknown-word`, `too-long`, `unknown-parameter`,
    /// `repeated`, or `invalid` if only `detail` explains the fault. More kinds may be added.
    #[schema(example = "out-of-range")]
    pub code: Cow<'static, str>,
    /// The value given and what is allowed.
    pub detail: String,
    /// The value given, unless it is an array, an object or a long text.
    #[schema(value_type = Option<Value>)]
    #[schema(nullable = true)]
    pub value: Option<Value>,
    /// Smallest number allowed.
    #[schema(value_type = Option<f64>)]
    pub minimum: Option<Number>,
    /// `true` if `minimum` itself is not allowed; absent otherwise.
    pub minimum_excluded: Option<bool>,
    /// Largest number, or largest number of characters, allowed.
    #[schema(value_type = Option<f64>)]
    pub maximum: Option<Number>,
    /// Unit of `minimum` and `maximum`.
    #[schema(value_type = Option<String>)]
    pub unit: Option<&'static str>,
    /// The values that are allowed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub allowed: Vec<String>,
}

impl Fault {
    /// Creates a fault of a query parameter.
    #[must_use]
    pub fn parameter(name: &str, detail: impl Into<String>) -> Self {
        Fault {
            parameter: Some(name.to_owned()),
            ..Fault::invalid(detail)
        }
    }

    /// Creates a fault with a detail only; the caller sets its location.
    #[must_use]
    pub fn invalid(detail: impl Into<String>) -> Self {
        Fault {
            code: FaultCode::default().code().into(),
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
            code: figures.code.code().into(),
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
    /// Creates a problem of this kind; `detail` describes the occurrence.
    #[must_use]
    pub(crate) fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        ProblemBody {
            kind: format!("/problems/{}", kind.slug()),
            title: kind.title().to_owned(),
            status: kind.status(),
            detail: detail.into(),
            ..ProblemBody::default()
        }
    }

    /// Returns the reason why a job failed.
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

/// A kind of problem, explained.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = ProblemKind)]
pub(crate) struct ProblemMeaning {
    /// The `type` of problems of this kind.
    #[serde(rename = "type")]
    #[schema(example = "/problems/faulty-case")]
    path: String,
    /// The kind in a few words.
    title: &'static str,
    /// HTTP status code.
    status: u16,
    /// What the kind means and what to do about it.
    meaning: &'static str,
}

impl From<ProblemKind> for ProblemMeaning {
    fn from(kind: ProblemKind) -> Self {
        ProblemMeaning {
            path: format!("/problems/{}", kind.slug()),
            title: kind.title(),
            status: kind.status(),
            meaning: kind.meaning(),
        }
    }
}

/// Declares the problems of a route for its documentation, besides those that all routes have in common.
macro_rules! problems {
    ($(#[$meta:meta])* $name:ident: $($kind:ident),* $(,)?) => {
        $(#[$meta])*
        pub(crate) struct $name;

        impl utoipa::IntoResponses for $name {
            fn responses() -> std::collections::BTreeMap<
                String,
                utoipa::openapi::RefOr<utoipa::openapi::Response>,
            > {
                $crate::problem::describe(&[$($crate::problem::ProblemKind::$kind),*])
            }
        }
    };
}
pub(crate) use problems;

problems! {
    /// Problems of a route without parameters.
    PlainProblems: BadQuery
}

/// Describes these kinds of problems, one response per status code.
#[must_use]
pub(crate) fn describe(
    kinds: &[ProblemKind],
) -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
    let mut by_status = BTreeMap::<u16, Vec<ProblemKind>>::new();
    for kind in kinds {
        by_status.entry(kind.status()).or_default().push(*kind);
    }
    by_status
        .into_iter()
        .map(|(status, kinds)| (status.to_string(), describe_together(&kinds)))
        .collect()
}

/// Describes these kinds of problems in one response.
pub(crate) fn describe_together(kinds: &[ProblemKind]) -> RefOr<utoipa::openapi::Response> {
    let lines: Vec<String> = kinds
        .iter()
        .map(|kind| format!("`{}`: {}", kind.slug(), kind.meaning()))
        .collect();
    let content = ContentBuilder::new()
        .schema(Some(Ref::from_schema_name("Problem")))
        .build();
    let mut response = ResponseBuilder::new()
        .description(lines.join("\n\n"))
        .content(PROBLEM_JSON, content);
    if kinds.iter().any(|kind| kind.passes()) {
        let header = seconds_header("Seconds to wait before trying again.");
        response = response.header("Retry-After", header);
    }
    response.build().into()
}

/// Describes a response header with a number of seconds.
pub(crate) fn seconds_header(about: &str) -> utoipa::openapi::Header {
    let number = ObjectBuilder::new().schema_type(Type::Integer);
    let header = HeaderBuilder::new().schema(Some(number));
    header.description(Some(about)).build()
}

/// Content type of every problem.
pub(crate) const PROBLEM_JSON: &str = "application/problem+json";

/// Seconds after which a client may retry.
const RETRY_SECONDS: u32 = 1;
/// Seconds after which a client may retry if the operator must free disk space first.
const DISK_RETRY_SECONDS: u32 = 10;

/// Most faults of a case in `errors`.
const FAULTS_LISTED: usize = 1000;

/// The result of a request.
pub(crate) type Result<T, E = ApiError> = std::result::Result<T, E>;

/// A failure of a request.
#[derive(Debug)]
pub struct ApiError {
    problem: Box<ProblemBody>,
    retry_after: Option<u32>,
}

impl ApiError {
    /// Creates a problem of this kind; `detail` describes the occurrence.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        ApiError {
            problem: Box::new(ProblemBody::new(kind, detail)),
            retry_after: kind.passes().then_some(RETRY_SECONDS),
        }
    }

    /// Sets the seconds after which the client may retry.
    #[must_use]
    pub fn after(mut self, seconds: u32) -> Self {
        self.retry_after = Some(seconds);
        self
    }

    /// Names the query parameter that the problem is about.
    #[must_use]
    pub fn about(mut self, parameter: &str) -> Self {
        let detail = self.problem.detail.clone();
        self.problem
            .errors
            .push(Fault::parameter(parameter, detail));
        self
    }

    /// Returns the description of the occurrence.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.problem.detail
    }

    /// Replaces the description of the occurrence.
    #[must_use]
    pub fn saying(mut self, detail: impl Into<String>) -> Self {
        self.problem.detail = detail.into();
        self
    }

    /// Creates a failure of the service itself. The reason is logged, and not sent to the client.
    #[must_use]
    pub fn internal(reason: impl std::fmt::Display) -> Self {
        tracing::error!(%reason, "a request failed inside the service");
        ApiError::new(
            ProblemKind::Internal,
            "the request could not be answered; the service's log has the reason under the request id",
        )
    }

    /// Creates the problem of malformed JSON, or of JSON with a value of a wrong type, with its position.
    #[must_use]
    pub fn malformed(error: &serde_json::Error) -> Self {
        let detail = format!("the JSON of the body cannot be read: {error}");
        let mut failure = ApiError::new(ProblemKind::MalformedJson, detail);
        failure.problem.line = Some(error.line());
        failure.problem.column = Some(error.column());
        failure
    }

    /// Creates the problem of an element of an array whose JSON cannot be read, with its index.
    #[must_use]
    pub fn malformed_element(index: u32, error: &serde_json::Error) -> Self {
        ApiError::new(
            ProblemKind::MalformedJson,
            format!(
                "element {index} (counted from 0) cannot be read as JSON: {error}, within the element"
            ),
        )
    }

    /// Creates a problem of this kind with a list of faults.
    #[must_use]
    pub fn listing(kind: ProblemKind, detail: impl Into<String>, faults: Vec<Fault>) -> Self {
        let mut failure = ApiError::new(kind, detail);
        failure.problem.errors = faults;
        failure
    }

    /// Creates the problem of a query with faults; `faults` is not empty.
    #[must_use]
    pub fn bad_query(faults: Vec<Fault>) -> Self {
        let details: Vec<&str> = faults.iter().map(|fault| &*fault.detail).collect();
        ApiError::listing(ProblemKind::BadQuery, details.join("; "), faults)
    }

    /// Creates the problem of a query parameter with a value that is not allowed.
    #[must_use]
    pub fn bad_parameter(name: &str, detail: impl Into<String>) -> Self {
        ApiError::bad_query(vec![Fault::parameter(name, detail)])
    }

    /// Creates the problem of a request header with a value that is not allowed.
    #[must_use]
    pub fn bad_header(name: &str, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        let fault = Fault {
            header: Some(name.to_owned()),
            ..Fault::invalid(detail.clone())
        };
        ApiError::listing(ProblemKind::BadHeader, detail, vec![fault])
    }
}

/// Creates the refusal of a table.
pub(crate) fn faulty(detail: impl Into<String>) -> ApiError {
    ApiError::new(ProblemKind::FaultyTable, detail)
}

impl From<CaseError> for ApiError {
    fn from(CaseError(faults): CaseError) -> Self {
        let detail = match faults.as_slice() {
            [fault] if fault.pointer.is_empty() => {
                format!("the case has 1 fault: {}", fault.detail)
            }
            [fault] => format!(
                "the case has 1 fault, `{}`: {}",
                fault.pointer, fault.detail
            ),
            faults if faults.len() > FAULTS_LISTED => format!(
                "the case has {} faults; the first {FAULTS_LISTED} are listed",
                faults.len()
            ),
            faults => format!("the case has {} faults", faults.len()),
        };
        let faults = faults.into_iter().take(FAULTS_LISTED).map(Fault::from);
        ApiError::listing(ProblemKind::FaultyCase, detail, faults.collect())
    }
}

impl From<TableError> for ApiError {
    fn from(error: TableError) -> Self {
        match error {
            TableError::Faulty { detail, columns } => {
                let faults = columns.into_iter().map(|(title, detail)| Fault {
                    pointer: Some(column_pointer(&title)),
                    ..Fault::invalid(detail)
                });
                ApiError::listing(ProblemKind::FaultyTable, detail, faults.collect())
            }
            TableError::TooLarge(detail) => ApiError::new(ProblemKind::BodyTooLarge, detail),
            TableError::Source(error) => ApiError::internal(&error),
        }
    }
}

impl From<JobsError> for ApiError {
    fn from(error: JobsError) -> Self {
        let kind = match error {
            JobsError::Case(faults) => return faults.into(),
            JobsError::BadCursor => return ApiError::bad_parameter("cursor", error.to_string()),
            JobsError::NotFound(kind) => ProblemKind::not_found(kind),
            JobsError::ProfileNotFound => ProblemKind::ProfileNotFound,
            JobsError::Expired => ProblemKind::Expired,
            JobsError::NotReady(_) => ProblemKind::ResultNotReady,
            JobsError::NotSucceeded(ref job) if job.state == State::Cancelled => {
                ProblemKind::JobCancelled
            }
            JobsError::NotSucceeded(_) => ProblemKind::JobFailed,
            JobsError::NotEnded(kind) => ProblemKind::not_ended(kind),
            JobsError::IdempotencyConflict => ProblemKind::IdempotencyConflict,
            JobsError::QueueFull(_) | JobsError::StagingFull(_) => ProblemKind::QueueFull,
            JobsError::QuotaExceeded(_) | JobsError::StagingQuotaExceeded(_) => {
                ProblemKind::QuotaExceeded
            }
            JobsError::StoredQuotaExceeded(_) => ProblemKind::StoredQuotaExceeded,
            JobsError::ProfilesFull(_) => ProblemKind::ProfilesFull,
            JobsError::TooManyRows(_) => ProblemKind::BodyTooLarge,
            JobsError::BoundKey { .. } => ProblemKind::Forbidden,
            JobsError::Draining => ProblemKind::Draining,
            other => {
                return match other.storage_fault() {
                    Some(fault) => storage_failed(fault, &other),
                    None => ApiError::internal(&other),
                };
            }
        };
        ApiError::new(kind, error.to_string())
    }
}

/// Returns the problem of a storage that rejects writes. The message of the system is logged.
fn storage_failed(fault: StorageFault, reason: &JobsError) -> ApiError {
    tracing::warn!(%reason, "a request failed because its storage is not available");
    let (kind, what) = match fault {
        StorageFault::Full => (ProblemKind::StorageFull, "the disk of the service is full"),
        StorageFault::Unwritable => (
            ProblemKind::StorageUnwritable,
            "the disk of the service cannot be written at the moment",
        ),
        StorageFault::Damaged => (
            ProblemKind::StorageUnwritable,
            "the job table of the service is damaged; its operator must restore a backup",
        ),
        StorageFault::Unreachable => (
            ProblemKind::StorageUnreachable,
            "the database or the store of results of the service cannot be reached at the moment",
        ),
    };
    ApiError::new(kind, what).after(DISK_RETRY_SECONDS)
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let mut response = render(&self.problem);
        if let Some(seconds) = self.retry_after {
            response
                .headers_mut()
                .insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if self.problem.status == 401 {
            let scheme = HeaderValue::from_static("Bearer realm=\"railhead\"");
            response
                .headers_mut()
                .insert(header::WWW_AUTHENTICATE, scheme);
        }
        // The path is not known here; `name_instance` serialises the problem again with it.
        response.extensions_mut().insert(self.problem);
        response
    }
}

/// Layer around all routes that adds the requested path to every problem.
pub(crate) async fn name_instance(request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let mut response = next.run(request).await;
    // The readable contract answers unknown files with plain text.
    if response.status() == StatusCode::NOT_FOUND
        && response.extensions().get::<Box<ProblemBody>>().is_none()
    {
        response = unknown_route(&path).into_response();
    }
    let Some(mut problem) = response.extensions_mut().remove::<Box<ProblemBody>>() else {
        return response;
    };
    problem.instance = Some(path);
    let (mut parts, _) = response.into_parts();
    parts.headers.remove(header::CONTENT_LENGTH);
    let (_, body) = render(&problem).into_parts();
    Response::from_parts(parts, body)
}

/// Returns the problem of a path without a resource.
#[must_use]
pub(crate) fn unknown_route(path: &str) -> ApiError {
    let advice = match path.len() > 1 && path.ends_with('/') {
        true => "the paths of this service do not end with a slash",
        false => "`/openapi.json` lists every resource, `/docs` shows them",
    };
    let detail = format!("there is nothing at `{path}`; {advice}");
    ApiError::new(ProblemKind::UnknownRoute, detail)
}

fn render(problem: &ProblemBody) -> Response {
    let status = StatusCode::from_u16(problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    match serde_json::to_vec(problem) {
        Ok(body) => (status, [(header::CONTENT_TYPE, PROBLEM_JSON)], body).into_response(),
        Err(error) => {
            tracing::error!(%error, "a problem could not be written as JSON");
            StatusCode::INTERNAL_SERVER_ERROR.into_response()
        }
    }
}
