//! `/v1/jobs`: submit, list, get, cancel, delete, and the case as it was submitted.

use std::time::Duration;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::words::question::Case;
use crate::http::dto::job::JobAnswer;
use crate::http::extract::accept::Format;
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::extract::json::JsonBody;
use crate::http::extract::query::{Parameters, Reader, count, id, query, reader};
use crate::http::extract::submit_options::SubmitQuery;
use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::{HeldShares, hold_while_sent};
use crate::http::limits::memory::Memory;
use crate::http::limits::shares::Share;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::routes::results::result_text;
use crate::jobs::model::{Job, State as JobState};
use crate::jobs::{Filter, Jobs, PAGE_MAX};

/// Longest time that `Prefer: wait` holds a request, in s.
pub const WAIT_MAX_SECONDS: u32 = 60;

/// Jobs in one page of a list when nothing is said.
const LIST_LIMIT_DEFAULT: u32 = 50;

/// Longest idempotency key in characters.
const IDEMPOTENCY_KEY_MAX_CHARS: usize = 255;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");
const IDEMPOTENCY_REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// A page of jobs, newest first.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobPage {
    /// The jobs of this page.
    jobs: Vec<JobAnswer>,
    /// Give this as `cursor` for the next page; null on the last one.
    next_cursor: Option<String>,
}

problems! {
    /// What `POST /v1/jobs` can fail with.
    SubmitProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding, FaultyCase,
    IdempotencyConflict, QuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable
}

/// Submits one case as a job.
///
/// A job answered with `202` or `200` is stored durably. With `Prefer: wait=N` the answer is the ended job (`200`) if it
/// ends within N seconds, including its result if it succeeded and its `error` if it failed. A case that is identical to one
/// solved before (`name` and `labels` aside) succeeds at once with that result, marked `cached`.
#[utoipa::path(
    post,
    path = "/v1/jobs",
    tag = "jobs",
    operation_id = "submit_job",
    params(
        SubmitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`: answer when the job has ended, at most N seconds (60 at most) later (RFC 7240)", example = "wait=10"),
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 255, pattern = "^[!-~]+$", description = "1 to 255 visible ASCII characters. Repeating a request with the same key, the same case and the same options answers the first job instead of making another"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache`: solve the case even if an identical one was solved before", example = "no-cache"),
        ("traceparent" = Option<String>, Header, description = "W3C trace context: where the service sends traces, that of the job goes on with the client's. What cannot be read is passed over", example = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01")
    ),
    request_body(content = Case, description = "One case", content_type = "application/json"),
    responses(
        (status = 202, description = "The job is stored and will be solved", body = JobAnswer, headers(
            ("Location" = String, description = "Path of the job"),
            ("Retry-After" = u32, description = "Seconds after which to look again"),
            ("Preference-Applied" = String, description = "The wait that was applied, if one was asked for"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the job of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        (status = 200, description = "The job ended within the time given by `Prefer: wait`", body = JobAnswer, headers(
            ("Location" = String, description = "Path of the job"),
            ("Preference-Applied" = String, description = "The wait that was applied"),
            ("Idempotency-Replayed" = String, description = "`true` if this is the job of an earlier request with the same `Idempotency-Key`; absent otherwise")
        )),
        SubmitProblems
    )
)]
pub async fn submit(
    Caller(jobs): Caller,
    uri: Uri,
    State(crowds): State<ConcurrencyLimits>,
    State(memory): State<Memory>,
    Extension(held): Extension<HeldShares>,
    headers: HeaderMap,
    JsonBody { value, room }: JsonBody,
) -> Result<Response, ApiError> {
    let key = idempotency_key(&headers)?;
    let place =
        preferred_wait(&headers).and_then(|seconds| Some((seconds, crowds.wait(jobs.tenant())?)));
    let wait = place.as_ref().map(|(seconds, _)| *seconds);
    let options = SubmitQuery::read(&uri, &())?.options(&headers);
    let (mut job, replayed) = jobs.submit_with(value, key, options).await?;
    drop(room);
    let location = format!("/v1/jobs/{}", job.id);
    if let Some(seconds) = wait {
        // From here on the request only waits, which is counted apart.
        held.release();
        // The job is stored: whatever ends the wait early, the client must learn its id.
        match jobs.wait(job.id, Duration::from_secs(seconds.into())).await {
            Ok(later) => job = later,
            Err(reason) => tracing::debug!(%reason, job = %job.id, "the wait ended early"),
        }
    }
    let in_time = wait.is_some() && job.state.ended();
    let status = if in_time {
        StatusCode::OK
    } else {
        StatusCode::ACCEPTED
    };
    let with_result = wait.is_some() && job.state == JobState::Succeeded;
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
    if let Some(applied) =
        wait.and_then(|seconds| HeaderValue::from_str(&format!("wait={seconds}")).ok())
    {
        response.headers_mut().insert(PREFERENCE_APPLIED, applied);
    }
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
pub fn mark_replay(response: &mut Response, replayed: bool) {
    if replayed {
        response
            .headers_mut()
            .insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
}

/// The wait that the client prefers, in s, capped. Preferences that are not understood are ignored (RFC 7240,
/// section 2); the first `wait` counts.
fn preferred_wait(headers: &HeaderMap) -> Option<u32> {
    let values = headers
        .get_all(&PREFER)
        .iter()
        .filter_map(|value| value.to_str().ok());
    let preferences = values.flat_map(|value| value.split([',', ';']));
    let mut waits = preferences.filter_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        let digits = value.trim().trim_matches('"');
        let whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        (name.trim().eq_ignore_ascii_case("wait") && whole)
            .then(|| digits.parse().unwrap_or(WAIT_MAX_SECONDS))
    });
    waits.next().map(|seconds| seconds.min(WAIT_MAX_SECONDS))
}

/// The idempotency key of a request, if it has one.
///
/// # Errors
/// It is too long, empty, or given twice.
pub fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, ApiError> {
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
    /// What `GET /v1/jobs` can fail with.
    ListProblems: BadQuery
}

query! {
    /// Filters and page of a list of jobs.
    ListQuery(() => ()) {
        /// Only jobs in this state
        state: JobState as JobState = reader(JobState::ALL.map(JobState::name).join(", "), JobState::from_name);
        /// Only jobs of this batch
        #[param(format = "uuid")]
        batch: Uuid as String = id("batch");
        /// Only jobs with this label, written `key:value`
        #[param(example = "line:A12")]
        label: (String, String) as String = reader("`key:value`", |text| {
            let (key, value) = text.split_once(':')?;
            Some((key.to_owned(), value.to_owned()))
        });
        /// Only jobs submitted at or after this time (RFC 3339)
        #[param(format = "date-time", example = "2026-01-31T09:30:00Z")]
        created_after: i64 as String = time();
        /// Only jobs submitted before this time (RFC 3339)
        #[param(format = "date-time")]
        created_before: i64 as String = time();
        /// Jobs in one page; 50 when left out
        #[param(minimum = 1, maximum = 1000)]
        limit: u32 as u32 = count(1, PAGE_MAX);
        /// `next_cursor` of the page before, with the same filters
        #[param(pattern = "^[0-9a-f]{40}$")]
        cursor: String as String = reader("a cursor of this service", |text| Some(text.to_owned()));
    }
}

/// A time, as milliseconds since 1970.
fn time() -> Reader<i64> {
    let allowed = "a time in RFC 3339 such as `2026-01-31T09:30:00Z` (write `+` as `%2B`)";
    reader(allowed, |text| {
        let time = text.parse::<jiff::Timestamp>();
        time.ok().map(jiff::Timestamp::as_millisecond)
    })
}

/// Lists jobs, newest first.
#[utoipa::path(
    get,
    path = "/v1/jobs",
    tag = "jobs",
    operation_id = "list_jobs",
    params(ListQuery),
    responses((status = 200, description = "A page of jobs", body = JobPage), ListProblems)
)]
pub async fn list(Caller(jobs): Caller, uri: Uri) -> Result<Json<JobPage>, ApiError> {
    let query = ListQuery::read(&uri, &())?;
    let filter = Filter {
        state: query.state,
        batch: query.batch,
        label: query.label,
        created_after: query.created_after,
        created_before: query.created_before,
    };
    let page = jobs
        .list(
            &filter,
            query.cursor.as_deref(),
            query.limit.unwrap_or(LIST_LIMIT_DEFAULT),
        )
        .await?;
    Ok(Json(JobPage {
        jobs: page.jobs.into_iter().map(JobAnswer::new).collect(),
        next_cursor: page.next_cursor,
    }))
}

problems! {
    /// What asking for one job can fail with.
    GetProblems: BadQuery, JobNotFound
}

/// Looks at a job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}",
    tag = "jobs",
    operation_id = "get_job",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 200, description = "The job", body = JobAnswer), GetProblems)
)]
pub async fn get(Caller(jobs): Caller, JobId(id): JobId) -> Result<Json<JobAnswer>, ApiError> {
    Ok(Json(JobAnswer::new(jobs.get_with_queue_place(id).await?)))
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
pub async fn case(Caller(jobs): Caller, JobId(id): JobId) -> Result<Response, ApiError> {
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
pub async fn cancel(Caller(jobs): Caller, JobId(id): JobId) -> Result<Response, ApiError> {
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
pub async fn delete(Caller(jobs): Caller, JobId(id): JobId) -> Result<StatusCode, ApiError> {
    jobs.delete(id).await?;
    Ok(StatusCode::NO_CONTENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait_of(prefer: &[&'static str]) -> Option<u32> {
        let mut headers = HeaderMap::new();
        for value in prefer {
            headers.append(PREFER, HeaderValue::from_static(value));
        }
        preferred_wait(&headers)
    }

    #[test]
    fn the_preferred_wait_is_read_and_capped() {
        assert_eq!(wait_of(&["wait=10"]), Some(10));
        assert_eq!(wait_of(&["respond-async, WAIT = \"7\""]), Some(7));
        assert_eq!(wait_of(&["handling=lenient", "wait=60"]), Some(60));
        assert_eq!(wait_of(&["wait=61"]), Some(60));
        assert_eq!(wait_of(&["wait=99999999999999999999"]), Some(60));
        for ignored in [
            "wait",
            "wait=",
            "wait=-1",
            "wait=1.5",
            "wait=soon",
            "await=3",
        ] {
            assert_eq!(wait_of(&[ignored]), None, "{ignored}");
        }
    }
}
