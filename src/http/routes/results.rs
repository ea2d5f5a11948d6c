//! `/v1/jobs/{id}/result`: everything small about the answer of a job.

use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use crate::http::dto::result::JobResult;
use crate::http::extract::accept::Format;
use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::extract::query::Query;
use crate::http::layers::etag::{Known, tagged};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::limits::memory::Memory;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
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
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 200, description = "The result", body = JobResult), ResultProblems)
)]
pub async fn result(
    Caller(jobs): Caller,
    JobId(id): JobId,
    State(memory): State<Memory>,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    // Its form was looked at before.
    Query::read(&uri, &["format"]).finish()?;
    let tag = match Known::of(&jobs, id, &uri, &headers, Format::Json).await? {
        Known::Unchanged(answer) => return Ok(answer),
        Known::Tag(tag) => tag,
    };
    let result = result_of(&jobs, id).await?;
    let text = serde_json::to_vec(&result).map_err(|error| ApiError::internal(&error))?;
    let share = memory.ready_answer(jobs.tenant(), text.len())?;
    let head = [(header::CONTENT_TYPE, Format::Json.media_type())];
    Ok(tagged(
        &tag,
        hold_while_sent((head, text).into_response(), share),
    ))
}

/// The result of a succeeded job with its links.
///
/// # Errors
/// The job is unknown, has not ended or has no result.
pub async fn result_of(jobs: &Jobs, id: Uuid) -> Result<JobResult, ApiError> {
    let answer = jobs.answer(id).await?;
    Ok(JobResult::new(
        id,
        answer.solution,
        answer.cached,
        &answer.outputs,
    ))
}
