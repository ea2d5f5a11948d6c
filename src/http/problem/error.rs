//! Every failure that a client can see, as `application/problem+json` (RFC 9457), and which error becomes which kind.

use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::contact::error::CaseError;
use crate::http::problem::body::{Fault, ProblemBody};
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::StorageFault;
use crate::jobs::error::JobsError;
use crate::jobs::model::job::State;
use crate::jobs::model::kind::Kind;

/// Content type of every failure.
pub(crate) const PROBLEM_JSON: &str = "application/problem+json";

/// Seconds after which a refused client may try again.
const RETRY_SECONDS: u32 = 1;
/// The same where somebody has to make room first.
const DISK_RETRY_SECONDS: u32 = 10;

/// Faults of one case that are listed.
const FAULTS_LISTED: usize = 1000;

/// A failure on its way to the client.
#[derive(Debug)]
pub struct ApiError {
    problem: Box<ProblemBody>,
    retry_after: Option<u32>,
}

impl ApiError {
    /// A problem of this kind with a sentence about this occurrence.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        ApiError {
            problem: Box::new(ProblemBody::new(kind, detail)),
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

    /// The sentence about this occurrence.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.problem.detail
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
            ProblemKind::Internal,
            "the request could not be answered; the service's log has the reason under the request id",
        )
    }

    /// Malformed JSON with its position.
    #[must_use]
    pub fn malformed(error: &serde_json::Error) -> Self {
        let mut failure = ApiError::new(
            ProblemKind::MalformedJson,
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
            ProblemKind::MalformedJson,
            format!(
                "the body is not JSON: element {index} (counted from 0): {error}, within the element"
            ),
        )
    }

    /// A problem of this kind with faults that clients can find.
    #[must_use]
    pub fn listing(kind: ProblemKind, detail: impl Into<String>, faults: Vec<Fault>) -> Self {
        let mut failure = ApiError::new(kind, detail);
        failure.problem.errors = faults;
        failure
    }

    /// A query with faults; `faults` is not empty.
    #[must_use]
    pub fn bad_query(faults: Vec<Fault>) -> Self {
        let details: Vec<&str> = faults.iter().map(|fault| &*fault.detail).collect();
        ApiError::listing(ProblemKind::BadQuery, details.join("; "), faults)
    }

    /// One query parameter with a value that is not allowed.
    #[must_use]
    pub fn bad_parameter(name: &str, detail: impl Into<String>) -> Self {
        ApiError::bad_query(vec![Fault::parameter(name, detail)])
    }

    /// A request header with a value that is not allowed.
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

impl From<JobsError> for ApiError {
    fn from(error: JobsError) -> Self {
        let kind = match error {
            JobsError::Case(faults) => return faults.into(),
            JobsError::NoSuchPatch { .. } => {
                return ApiError::bad_parameter("patch", error.to_string());
            }
            JobsError::NoSuchPoint { .. } => {
                return ApiError::bad_parameter("point", error.to_string());
            }
            JobsError::BadCursor => return ApiError::bad_parameter("cursor", error.to_string()),
            JobsError::NotFound => ProblemKind::JobNotFound,
            JobsError::BatchNotFound(Kind::Rows) => ProblemKind::RunNotFound,
            JobsError::BatchNotFound(_) => ProblemKind::BatchNotFound,
            JobsError::ProfileNotFound => ProblemKind::ProfileNotFound,
            JobsError::Expired => ProblemKind::Expired,
            JobsError::NotReady(_) => ProblemKind::ResultNotReady,
            JobsError::NotSucceeded(ref job) if job.state == State::Cancelled => {
                ProblemKind::JobCancelled
            }
            JobsError::NotSucceeded(_) => ProblemKind::JobFailed,
            JobsError::NotEnded(_) => ProblemKind::JobNotEnded,
            JobsError::BatchNotEnded(Kind::Rows, _) => ProblemKind::RunNotEnded,
            JobsError::BatchNotEnded(..) => ProblemKind::BatchNotEnded,
            JobsError::IdempotencyConflict => ProblemKind::IdempotencyConflict,
            JobsError::QueueFull { .. } | JobsError::StagingFull { .. } => ProblemKind::QueueFull,
            JobsError::QuotaExceeded { .. } | JobsError::StagingQuotaExceeded { .. } => {
                ProblemKind::QuotaExceeded
            }
            JobsError::StoredQuotaExceeded { .. } => ProblemKind::StoredQuotaExceeded,
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

/// The storage rejects writes; the log has the message of the system.
fn storage_failed(fault: StorageFault, reason: &JobsError) -> ApiError {
    tracing::warn!(%reason, "a request failed for want of its storage");
    let (kind, what) = match fault {
        StorageFault::Full => (ProblemKind::StorageFull, "the disk of the service is full"),
        StorageFault::Unwritable => (
            ProblemKind::StorageUnwritable,
            "the disk of the service cannot be written at the moment",
        ),
        StorageFault::Damaged => (
            ProblemKind::StorageUnwritable,
            "the job table of the service is damaged; its operator has to restore it",
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
        // The handler does not know the path it answers for; `name_instance` writes the problem again with it.
        response.extensions_mut().insert(self.problem);
        response
    }
}

/// Completes every problem with the path it is about; layer around all routes.
pub(crate) async fn name_instance(request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let mut response = next.run(request).await;
    // The readable contract answers unknown files of its own with bare text.
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

/// The answer for a path that names nothing.
#[must_use]
pub(crate) fn unknown_route(path: &str) -> ApiError {
    if path.len() > 1 && path.ends_with('/') {
        let detail = format!(
            "there is nothing at `{path}`; the paths of this service do not end with a slash"
        );
        return ApiError::new(ProblemKind::UnknownRoute, detail);
    }
    ApiError::new(
        ProblemKind::UnknownRoute,
        format!(
            "there is nothing at `{path}`; `/openapi.json` lists every resource, `/docs` shows them"
        ),
    )
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
