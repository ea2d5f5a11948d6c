//! Every failure a client can see, as `application/problem+json` (RFC 9457); the only file that knows status codes of failures.

use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::contact::error::CaseError;
use crate::http::problem::{Fault, Problem};
use crate::jobs::Trouble;
use crate::jobs::error::JobsError;
use crate::jobs::job::{Job, State};

/// Content type of every failure.
pub const PROBLEM_JSON: &str = "application/problem+json";

/// Seconds after which a refused client may try again.
const RETRY_SECONDS: u32 = 1;
/// The same where somebody has to make room first.
const DISK_RETRY_SECONDS: u32 = 10;

/// Faults of one case that are listed.
const FAULTS_LISTED: usize = 1000;

/// Declares the kinds of problems once: name, status, slug, title, meaning.
macro_rules! kinds {
    ($($kind:ident $status:literal $slug:literal $title:literal $meaning:literal)*) => {
        /// A kind of problem; its slug is the last part of the problem's `type`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind { $(#[doc = $meaning] $kind,)* }

        impl Kind {
            /// Every kind there is.
            pub const ALL: &[Kind] = &[$(Kind::$kind),*];

            /// The last part of the problem's `type`.
            #[must_use]
            pub fn slug(self) -> &'static str { match self { $(Kind::$kind => $slug),* } }

            /// The problem's `title`.
            #[must_use]
            pub fn title(self) -> &'static str { match self { $(Kind::$kind => $title),* } }

            /// What this kind means and what to do about it.
            #[must_use]
            pub fn meaning(self) -> &'static str { match self { $(Kind::$kind => $meaning),* } }

            /// The status code that goes with it.
            #[must_use]
            pub fn status(self) -> u16 { match self { $(Kind::$kind => $status),* } }
        }
    };
}

kinds! {
    MalformedJson 400 "malformed-json" "The body is not JSON" "The body could not be parsed as JSON; `line` and `column` say where. Members written twice and numbers too large for a 64-bit float count as malformed."
    BadQuery 400 "bad-query" "The query is not understood" "A query parameter is unknown, repeated or has a value that is not allowed; `errors` names every such parameter."
    BadHeader 400 "bad-header" "A header is not understood" "A request header has a value that is not allowed; `errors` names it."
    UnreadableBody 400 "unreadable-body" "The body could not be read" "The connection ended or broke before the whole body had arrived."
    Unauthorized 401 "unauthorized" "A key is needed" "The service is asked with `Authorization: Bearer` and an API key; there was none, or it is unknown or revoked. Keys come from the operator of the service."
    Forbidden 403 "forbidden" "This key may not do that" "The key is good, but belongs to a tenant that has no business here."
    CrossSite 403 "cross-site" "A foreign page may not change anything" "Without a key nothing is changed on behalf of a web page of another origin; the operator names origins that may with `--cors-origin`."
    HostNotAllowed 403 "host-not-allowed" "The service has another name" "Without a key the service is asked by an address, as `localhost`, or by a name that its operator gave with `--allowed-host`; `Host` was another."
    UnknownRoute 404 "unknown-route" "There is nothing at this address" "The path names no resource of this service; `/openapi.json` lists all of them."
    JobNotFound 404 "job-not-found" "There is no such job" "No job has this id; it was never made here, or it was deleted."
    BatchNotFound 404 "batch-not-found" "There is no such batch" "No batch has this id; it was never made here, or it was deleted."
    OutputNotAsked 404 "output-not-asked" "This output was not asked for" "The case did not ask for this output, so it was not computed; submit the case again with the output named in `outputs`."
    MethodNotAllowed 405 "method-not-allowed" "This method is not allowed here" "The resource exists, but not for this HTTP method; the header `Allow` lists those it has."
    NotAcceptable 406 "not-acceptable" "This form cannot be answered" "The header `Accept` excludes every form in which this resource can be answered, or `format` names another; the detail names them. Most answer `application/json` only."
    BodyTimeout 408 "body-timeout" "The body came too slowly" "The whole body did not arrive within the allowed time (60 s for one case), or a batch came at less than 1024 bytes per second."
    ResultNotReady 409 "result-not-ready" "The job has not ended" "The job is queued or running, so there is no result yet; ask again after `Retry-After` seconds, or submit with `Prefer: wait=N`."
    JobFailed 409 "job-failed" "The job failed" "The job ended without a result; the member `error` of the job says why."
    JobCancelled 409 "job-cancelled" "The job was cancelled" "The job was cancelled before it had a result."
    JobNotEnded 409 "job-not-ended" "The job has not ended" "Only an ended job can be deleted; cancel it first."
    BatchNotEnded 409 "batch-not-ended" "The batch has not ended" "Only a batch of which every job has ended can be deleted; cancel it first."
    Expired 410 "expired" "This has expired" "The job or batch was here, but ended longer ago than this service keeps ended jobs (`expires_at` of a job says until when); it was removed with its results. Its id is remembered for 30 days."
    BodyTooLarge 413 "body-too-large" "The body is too large" "The body exceeds the size that this service accepts for one case, or for a batch; or a batch has too many cases."
    UnsupportedMediaType 415 "unsupported-media-type" "The body is not declared as JSON" "A case is sent with `Content-Type: application/json`, a batch also with `application/x-ndjson`."
    UnsupportedEncoding 415 "unsupported-encoding" "The body is packed in a way that is not understood" "A body may be sent with `Content-Encoding: gzip` or `zstd`, one of them, or as it is; `Accept-Encoding` of the answer names them."
    FaultyCase 422 "faulty-case" "The case has faults" "The body is JSON but not a case that can be solved; `errors` names every fault by its JSON pointer, with the value given and what is allowed."
    FaultyBatch 422 "faulty-batch" "The batch has faults" "The body holds no cases, or some of them have faults: `errors` names every fault by a JSON pointer that begins with the place of its case (counted from 0), and by its line in NDJSON. Nothing was stored; with `?accept=valid` the good cases are taken."
    FaultyTable 422 "faulty-table" "The header of the table has faults" "The first line of a table names its columns by JSON pointers such as `/load/normal_force_n` or by short names; the detail names the column and what is allowed."
    TooManyRequests 429 "too-many-requests" "Too many requests" "The key, or without one the address, sends more requests per second than it may, or the tenant has as many requests, streams or waits under way as it may; the detail says which. Try again after `Retry-After` seconds."
    QuotaExceeded 429 "quota-exceeded" "Too many jobs are waiting" "The tenant has as many queued jobs as it may; nothing was stored, try again after `Retry-After` seconds."
    IdempotencyConflict 422 "idempotency-conflict" "The idempotency key belongs to another case" "The `Idempotency-Key` was used before with a different body, priority, deadline or `no-cache`; use a new key for a new case."
    Internal 500 "internal" "The service failed" "Something went wrong inside the service; its log has the reason under the request id in the header `x-request-id`."
    QueueFull 503 "queue-full" "The queue is full" "The service holds as many unfinished jobs as it may; nothing was stored, try again after `Retry-After` seconds."
    StorageUnwritable 503 "storage-unwritable" "The disk cannot be written" "The disk of the service is read-only or fails, or its job table is locked by another process; nothing was stored, jobs already accepted are kept. Try again after `Retry-After` seconds."
    StorageFull 507 "storage-full" "The disk is full" "The disk of the service has no room for another job; nothing was stored, jobs already accepted are kept. Try again after `Retry-After` seconds."
    Draining 503 "draining" "The service is shutting down" "The service takes no new jobs because it is shutting down; jobs already accepted are kept. Try again after `Retry-After` seconds."
    Overloaded 503 "overloaded" "The service has too much to do" "The memory or the turns for requests of this kind are taken, or every connection has a request under way; nothing was done. Try again after `Retry-After` seconds."
    NotReady 503 "not-ready" "The service is not ready" "The job store cannot be reached at the moment."
    NotConverged 422 "not-converged" "The solver did not converge" "Only inside a job: the iteration ended without meeting its tolerance; `residual` and `iterations` belong to the best iterate, `detail` says what to try."
    Unsolvable 422 "unsolvable" "The contact has no answer" "Only inside a job: the region cannot be meshed or the contact does not exist; the detail says why."
    OutOfTime 422 "out-of-time" "The solve ran out of time" "Only inside a job: the case's `solver.time_limit_s` was used up."
    DeadlinePassed 422 "deadline-passed" "The job came too late" "Only inside a job: `deadline_s` of the submission was over before the job had ended; it was not solved any further."
    SolverPanic 500 "solver-panic" "The solver failed" "Only inside a job: the solver stopped on a defect of its own. Other jobs are not affected."
    WorkerLost 500 "worker-lost" "The workers of this job were lost" "Only inside a job: each worker that took the job ended without an answer, as often as is allowed."
}

impl Kind {
    /// Does it pass with time, so that the answer carries `Retry-After`?
    #[must_use]
    pub fn passes(self) -> bool {
        matches!(
            self,
            Kind::ResultNotReady
                | Kind::TooManyRequests
                | Kind::QuotaExceeded
                | Kind::QueueFull
                | Kind::StorageUnwritable
                | Kind::StorageFull
                | Kind::Draining
                | Kind::Overloaded
                | Kind::NotReady
        )
    }
}

/// A failure on its way to the client.
#[derive(Debug)]
pub struct ApiError {
    problem: Box<Problem>,
    retry_after: Option<u32>,
}

impl ApiError {
    /// A problem of this kind with a sentence about this occurrence.
    #[must_use]
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        ApiError {
            problem: Box::new(Problem::new(kind, detail)),
            retry_after: kind.passes().then_some(RETRY_SECONDS),
        }
    }

    /// The same, with the seconds after which to try again.
    #[must_use]
    pub fn after(mut self, seconds: u32) -> Self {
        self.retry_after = Some(seconds);
        self
    }

    /// The same, naming the query parameter that it is about.
    #[must_use]
    pub fn about(mut self, parameter: &str) -> Self {
        let detail = self.problem.detail.clone();
        self.problem
            .errors
            .push(Fault::parameter(parameter, detail));
        self
    }

    /// The same in other words.
    #[must_use]
    pub fn saying(mut self, detail: impl Into<String>) -> Self {
        self.problem.detail = detail.into();
        self
    }

    /// A failure of the service itself: the reason goes to the log, not to the client.
    #[must_use]
    pub fn internal(reason: &dyn std::fmt::Display) -> Self {
        tracing::error!(%reason, "a request failed inside the service");
        ApiError::new(
            Kind::Internal,
            "the request could not be answered; the service's log has the reason under the request id",
        )
    }

    /// Malformed JSON with its position.
    #[must_use]
    pub fn malformed(error: &serde_json::Error) -> Self {
        let mut failure = ApiError::new(
            Kind::MalformedJson,
            format!("the body is not JSON: {error}"),
        );
        failure.problem.line = Some(error.line());
        failure.problem.column = Some(error.column());
        failure
    }

    /// An element of an array that is not JSON, with its place in the array.
    #[must_use]
    pub fn malformed_element(index: u32, error: &serde_json::Error) -> Self {
        ApiError::new(
            Kind::MalformedJson,
            format!(
                "the body is not JSON: element {index} (counted from 0): {error}, within the element"
            ),
        )
    }

    /// A batch that is refused; `faults` names its faulty cases.
    #[must_use]
    pub fn faulty_batch(detail: String, faults: Vec<Fault>) -> Self {
        let mut failure = ApiError::new(Kind::FaultyBatch, detail);
        failure.problem.errors = faults;
        failure
    }

    /// A query with faults; `faults` is not empty.
    #[must_use]
    pub fn bad_query(faults: Vec<Fault>) -> Self {
        let names: Vec<String> = faults.iter().map(|fault| fault.detail.clone()).collect();
        let mut failure = ApiError::new(Kind::BadQuery, names.join("; "));
        failure.problem.errors = faults;
        failure
    }

    /// One query parameter with a value that is not allowed.
    #[must_use]
    pub fn bad_parameter(name: &str, detail: impl Into<String>) -> Self {
        ApiError::bad_query(vec![Fault::parameter(name, detail)])
    }

    /// A number of a motion or patch beyond the `count` that there are.
    #[must_use]
    pub fn no_such_index(name: &str, count: usize) -> Self {
        ApiError::bad_parameter(
            name,
            format!(
                "`{name}` is too large; allowed: 0 to {}",
                count.saturating_sub(1)
            ),
        )
    }

    /// A request header with a value that is not allowed.
    #[must_use]
    pub fn bad_header(name: &str, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        let mut failure = ApiError::new(Kind::BadHeader, detail.clone());
        failure.problem.errors = vec![Fault {
            pointer: None,
            parameter: None,
            header: Some(name.to_owned()),
            line: None,
            detail,
        }];
        failure
    }
}

impl From<CaseError> for ApiError {
    fn from(CaseError(faults): CaseError) -> Self {
        let detail = match faults.len() {
            1 => "the case has 1 fault".to_owned(),
            count if count > FAULTS_LISTED => {
                format!("the case has {count} faults; the first {FAULTS_LISTED} are listed")
            }
            count => format!("the case has {count} faults"),
        };
        let mut failure = ApiError::new(Kind::FaultyCase, detail);
        failure.problem.errors = faults
            .into_iter()
            .take(FAULTS_LISTED)
            .map(|fault| Fault {
                pointer: Some(fault.pointer),
                parameter: None,
                header: None,
                line: None,
                detail: fault.detail,
            })
            .collect();
        failure
    }
}

impl From<JobsError> for ApiError {
    fn from(error: JobsError) -> Self {
        match error {
            JobsError::Case(faults) => faults.into(),
            JobsError::NotFound => ApiError::new(Kind::JobNotFound, "no job has this id"),
            JobsError::Expired => ApiError::new(
                Kind::Expired,
                "ended longer ago than this service keeps ended jobs, so it was removed",
            ),
            JobsError::BatchNotFound => ApiError::new(Kind::BatchNotFound, "no batch has this id"),
            JobsError::NotReady(state) => ApiError::new(
                Kind::ResultNotReady,
                format!("the job is {}, so there is no result yet", state.name()),
            ),
            JobsError::NotSucceeded(job) => without_result(&job),
            JobsError::NotEnded(_) => ApiError::new(
                Kind::JobNotEnded,
                "the job is queued or running; cancel it first, then delete it",
            ),
            JobsError::BatchNotEnded(jobs) => ApiError::new(
                Kind::BatchNotEnded,
                format!(
                    "{jobs} jobs of the batch are queued or running; cancel it first, then delete it"
                ),
            ),
            JobsError::NoSuchPatch { patches } => ApiError::no_such_index("patch", patches),
            JobsError::NoSuchPoint { points } => ApiError::no_such_index("point", points),
            JobsError::IdempotencyConflict => ApiError::new(
                Kind::IdempotencyConflict,
                "this `Idempotency-Key` was used before with a different case",
            ),
            JobsError::QueueFull { queue_max } => ApiError::new(
                Kind::QueueFull,
                format!("{queue_max} jobs are waiting, which is the limit; nothing was stored"),
            ),
            JobsError::QuotaExceeded { queue_max } => ApiError::new(
                Kind::QuotaExceeded,
                format!(
                    "{queue_max} jobs of this tenant are waiting, which is its limit; nothing was stored"
                ),
            ),
            JobsError::StagingQuotaExceeded { .. } => {
                ApiError::new(Kind::QuotaExceeded, error.to_string())
            }
            JobsError::StagingFull { .. } => ApiError::new(Kind::QueueFull, error.to_string()),
            JobsError::BadCursor => ApiError::bad_parameter(
                "cursor",
                "`cursor` is not one that this service gave out for the same filters; start again without it",
            ),
            JobsError::Draining => ApiError::new(
                Kind::Draining,
                "the service is shutting down and takes no new jobs",
            ),
            other => match other.trouble() {
                Some(trouble) => troubled(trouble, &other),
                None => ApiError::internal(&other),
            },
        }
    }
}

/// The disk takes nothing; the log has the system's own words.
fn troubled(trouble: Trouble, reason: &JobsError) -> ApiError {
    tracing::warn!(%reason, "a request failed for want of a disk");
    let (kind, what) = match trouble {
        Trouble::Full => (Kind::StorageFull, "the disk of the service is full"),
        Trouble::Unwritable => (
            Kind::StorageUnwritable,
            "the disk of the service cannot be written at the moment",
        ),
    };
    ApiError::new(kind, what).after(DISK_RETRY_SECONDS)
}

/// Why an ended job has no result.
fn without_result(job: &Job) -> ApiError {
    if job.state == State::Cancelled {
        return ApiError::new(
            Kind::JobCancelled,
            "the job was cancelled, so it has no result",
        );
    }
    let reason = job
        .failure
        .as_ref()
        .map_or("the reason is not known", |failure| &failure.detail);
    ApiError::new(
        Kind::JobFailed,
        format!("the job failed, so it has no result: {reason}"),
    )
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
        // The handler does not know the path it answers for; `name_instance` writes the problem again with it.
        response.extensions_mut().insert(self.problem);
        response
    }
}

/// Completes every problem with the path it is about; layer around all routes.
pub async fn name_instance(request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let mut response = next.run(request).await;
    // The readable contract answers unknown files of its own with bare text.
    if response.status() == StatusCode::NOT_FOUND
        && response.extensions().get::<Box<Problem>>().is_none()
    {
        response = unknown_route(&path).into_response();
    }
    let Some(mut problem) = response.extensions_mut().remove::<Box<Problem>>() else {
        return response;
    };
    problem.instance = Some(path);
    let (mut parts, _) = response.into_parts();
    parts.headers.remove(header::CONTENT_LENGTH);
    let (_, body) = render(&problem).into_parts();
    Response::from_parts(parts, body)
}

/// The answer for a path that names nothing.
#[must_use]
pub fn unknown_route(path: &str) -> ApiError {
    if path.len() > 1 && path.ends_with('/') {
        let detail = format!(
            "there is nothing at `{path}`; the paths of this service do not end with a slash"
        );
        return ApiError::new(Kind::UnknownRoute, detail);
    }
    ApiError::new(
        Kind::UnknownRoute,
        format!(
            "there is nothing at `{path}`; `/openapi.json` lists every resource, `/docs` shows them"
        ),
    )
}

fn render(problem: &Problem) -> Response {
    let status = StatusCode::from_u16(problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    match serde_json::to_vec(problem) {
        Ok(body) => (status, [(header::CONTENT_TYPE, PROBLEM_JSON)], body).into_response(),
        Err(error) => {
            tracing::error!(%error, "a problem could not be written as JSON");
            StatusCode::INTERNAL_SERVER_ERROR.into_response()
        }
    }
}
