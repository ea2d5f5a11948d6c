//! `/v1/jobs`: submit, get, cancel, delete, and the case as it was submitted.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};

use crate::contact::case::words::question::Case;
use crate::http::dto::job::JobAnswer;
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::extract::json::JsonBody;
use crate::http::extract::query::Parameters;
use crate::http::extract::submit_options::SubmitQuery;
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::limits::shares::Share;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::routes::results::result_text;
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::jobs::Jobs;
use crate::jobs::model::job::{Job, State as JobState};

/// Longest idempotency key in characters.
const IDEMPOTENCY_KEY_MAX_CHARS: usize = 255;

const IDEMPOTENCY_REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

problems! {
    /// What `POST /v1/jobs` can fail with.
    SubmitProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding, FaultyCase,
    IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

/// Submits one case as a job.
///
/// A job answered with `202` or `200` is stored durably. With `?wait=N` or `Prefer: wait=N` the answer is the ended job (`200`) if it
/// ends within N seconds, including its result if it succeeded and its `error` if it failed. A case that is identical to one
/// solved before (`name` and `labels` aside) succeeds at once with that result, marked `cached`.
#[utoipa::path(
    post,
    path = "/v1/jobs",
    tag = "jobs",
    operation_id = "submit_job",
    params(
        SubmitQuery,
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10"),
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 255, pattern = "^[!-~]+$", description = "1 to 255 visible ASCII characters. Repeating a request with the same key, the same case and the same options answers the first job instead of making another"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache`: solve the case even if an identical one was solved before", example = "no-cache"),
        ("traceparent" = Option<String>, Header, description = "W3C trace context: if the service exports traces, the trace of the job continues the client's trace. An unreadable value is ignored", example = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01")
    ),
    request_body(content = Case, description = "One case", content_type = "application/json"),
    responses(
        (status = 202, description = "The job is stored and will be solved", body = JobAnswer, headers(
            ("Location" = String, description = "Path of the job"),
            ("Retry-After" = u32, description = "Seconds to wait before asking again"),
            ("Preference-Applied" = String, description = "The wait that was applied, if one was asked for"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the job of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        (status = 200, description = "The job ended within the wait", body = JobAnswer, headers(
            ("Location" = String, description = "Path of the job"),
            ("Preference-Applied" = String, description = "The wait that was applied"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the job of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        SubmitProblems
    )
)]
pub(crate) async fn submit(
    Caller(jobs): Caller,
    uri: Uri,
    wait: Wait,
    State(memory): State<Memory>,
    headers: HeaderMap,
    JsonBody { value, room }: JsonBody,
) -> Result<Response, ApiError> {
    let key = idempotency_key(&headers)?;
    let (submit, _) = <(SubmitQuery, WaitQuery)>::read(&uri, &())?;
    let options = submit.options(&headers);
    let announcements = jobs.announcements();
    let (mut job, replayed) = jobs.submit_with(value, key, options).await?;
    drop(room);
    let location = format!("/v1/jobs/{}", job.id);
    // The job is stored: whatever ends the wait early, the client must learn its id.
    let stored = job.clone();
    let waited = wait.hold(&jobs, async |at_most| {
        jobs.wait_from(announcements, stored, at_most).await
    });
    match waited.await {
        Ok(Some(Ok(later))) => job = later,
        Ok(Some(Err(reason))) => {
            tracing::debug!(%reason, job = %job.id, "the wait ended early");
        }
        Ok(None) | Err(_) => {}
    }
    let waits = wait.at_most().is_some();
    let in_time = waits && job.state.ended();
    let status = if in_time {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    let with_result = waits && job.state == JobState::Succeeded;
    let (body, share) = job_text(&jobs, &memory, job, with_result).await?;
    let head = [
        (header::LOCATION, location.as_str()),
        (header::CONTENT_TYPE, Format::Json.media_type()),
    ];
    let response = (status, head, body).into_response();
    let mut response = hold_while_sent(response, share);
    if !in_time {
        response
            .headers_mut()
            .insert(header::RETRY_AFTER, HeaderValue::from(1));
    }
    let mut response = wait.tell_applied(response);
    mark_replay(&mut response, replayed);
    Ok(response)
}

/// A job as JSON, with its result if that is wanted and can be read, and the memory for what is held of it.
async fn job_text(
    jobs: &Jobs,
    memory: &Memory,
    job: Job,
    with_result: bool,
) -> Result<(Body, Option<Share>), ApiError> {
    let id = job.id;
    let text = serde_json::to_string(&JobAnswer::new(job));
    let text = text.map_err(|error| ApiError::internal(&error))?;
    if with_result && let Some(open) = text.strip_suffix('}') {
        // A client that submitted a job must learn its id, whatever became of the result.
        match result_text(jobs, memory, id, [&format!("{open},\"result\":"), "}"]).await {
            Ok(answer) => return Ok(answer),
            Err(error) => tracing::error!(?error, job = %id, "a result cannot be read"),
        }
    }
    Ok((Body::from(text), None))
}

/// Says that a response is about what an earlier request with the same idempotency key made.
pub(crate) fn mark_replay(response: &mut Response, replayed: bool) {
    if replayed {
        response
            .headers_mut()
            .insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
}

/// The idempotency key of a request, if it has one.
///
/// # Errors
/// It is too long, empty, or given twice.
pub(crate) fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, ApiError> {
    let Some(value) = headers.get(&IDEMPOTENCY_KEY) else {
        return Ok(None);
    };
    let key = value.to_str().unwrap_or_default();
    let allowed = 1..=IDEMPOTENCY_KEY_MAX_CHARS;
    let visible = key.bytes().all(|byte| byte.is_ascii_graphic());
    if visible
        && allowed.contains(&key.len())
        && headers.get_all(&IDEMPOTENCY_KEY).iter().count() == 1
    {
        return Ok(Some(key.to_owned()));
    }
    Err(ApiError::bad_header(
        "Idempotency-Key",
        format!(
            "`Idempotency-Key` is one value of 1 to {IDEMPOTENCY_KEY_MAX_CHARS} visible ASCII characters"
        ),
    ))
}

problems! {
    /// What asking for one job can fail with.
    GetProblems: BadQuery, JobNotFound
}

/// Returns a job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}",
    tag = "jobs",
    operation_id = "get_job",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "The job", body = JobAnswer, headers(
        ("Preference-Applied" = String, description = "The wait that was applied, if one was asked for")
    )), GetProblems)
)]
pub(crate) async fn get(
    Caller(jobs): Caller,
    JobId(id): JobId,
    wait: Wait,
) -> Result<Response, ApiError> {
    if let Some(ended) = wait
        .hold(&jobs, async |at_most| jobs.wait(id, at_most).await)
        .await?
    {
        ended?;
    }
    let job = Json(JobAnswer::new(jobs.get_with_queue_place(id).await?));
    Ok(wait.tell_applied(job.into_response()))
}

/// The case of a job, as it was submitted.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/case",
    tag = "jobs",
    operation_id = "get_case",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 200, description = "The case", body = Case), GetProblems)
)]
pub(crate) async fn case(Caller(jobs): Caller, JobId(id): JobId) -> Result<Response, ApiError> {
    let text = jobs.case(id).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}

/// Stops a queued or running job. A job that has already ended stays as it is.
#[utoipa::path(
    post,
    path = "/v1/jobs/{id}/cancel",
    tag = "jobs",
    operation_id = "cancel_job",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses(
        (status = 200, description = "The job has ended", body = JobAnswer),
        (status = 202, description = "The running job will stop shortly", body = JobAnswer),
        GetProblems
    )
)]
pub(crate) async fn cancel(Caller(jobs): Caller, JobId(id): JobId) -> Result<Response, ApiError> {
    let job = jobs.cancel(id).await?;
    let status = if job.state.ended() {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    Ok((status, Json(JobAnswer::new(job))).into_response())
}

problems! {
    /// What deleting a job can fail with.
    DeleteProblems: BadQuery, JobNotFound, JobNotEnded
}

/// Removes an ended job with its case and its result.
#[utoipa::path(
    delete,
    path = "/v1/jobs/{id}",
    tag = "jobs",
    operation_id = "delete_job",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 204, description = "The job is gone"), DeleteProblems)
)]
pub(crate) async fn delete(Caller(jobs): Caller, JobId(id): JobId) -> Result<StatusCode, ApiError> {
    jobs.delete(id).await?;
    Ok(StatusCode::NO_CONTENT)
}
