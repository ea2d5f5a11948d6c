//! `/v1/jobs/{id}/result`: everything small about the answer of a job.

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, TryStreamExt, stream};
use uuid::Uuid;

use crate::http::dto::result::JobResult;
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::layers::etag::{Precondition, tagged};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::{Memory, SMALL_BYTES};
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::routes::wait::{Wait, WaitQuery};
use crate::http::routes::work::await_end;
use crate::jobs::Jobs;

problems! {
    /// What every part of a result can fail with.
    ResultProblems: BadQuery, JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// The result of a succeeded job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/result",
    tag = "results",
    operation_id = "get_result",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        WaitQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N`, as `?wait=N` (RFC 7240)", example = "wait=10")
    ),
    responses((status = 200, description = "The result", body = JobResult, headers(
        ("Preference-Applied" = String, description = "The wait that was applied, if one was asked for")
    )), ResultProblems)
)]
pub(crate) async fn result(
    Caller(jobs): Caller,
    JobId(id): JobId,
    wait: Wait,
    State(memory): State<Memory>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    await_end(&jobs, id, &wait).await?;
    let tag = match Precondition::of(&jobs, id, &uri, &headers, Format::Json).await? {
        Precondition::NotModified(answer) => return Ok(answer),
        Precondition::Proceed(tag) => tag,
    };
    let (body, share) = result_text(&jobs, &memory, id, ["", ""]).await?;
    let head = [(header::CONTENT_TYPE, Format::Json.media_type())];
    let response = wait.tell_applied((head, body).into_response());
    Ok(tagged(&tag, hold_while_sent(response, share)))
}

/// The text of the result of a succeeded job between two other texts, and the memory for what is held of it. A large result is
/// read from where it is stored while the client takes it.
///
/// # Errors
/// The job is unknown, has not ended or has no result; or there is no memory.
pub(crate) async fn result_text(
    jobs: &Jobs,
    memory: &Memory,
    id: Uuid,
    around: [&str; 2],
) -> Result<(Body, Option<Permit>), ApiError> {
    let answer = jobs.open_answer(id).await?;
    let share = memory.ready_answer(jobs.tenant(), answer.held_bytes)?;
    let tail = JobResult::tail(id, answer.cached, &answer.outputs)?;
    let [before, behind] = around;
    let before = Bytes::from(before.to_owned());
    let behind = Bytes::from(tail + behind);
    let pieces = stream::iter([Ok(before)])
        .chain(answer.open_solution)
        .chain(stream::iter([Ok(behind)]));
    let body = if answer.bytes <= SMALL_BYTES {
        let pieces: Vec<Bytes> = pieces.try_collect().await?;
        Body::from(pieces.concat())
    } else {
        Body::from_stream(pieces)
    };
    Ok((body, share))
}
