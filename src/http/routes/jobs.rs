//! `/v1/jobs`: submission of a case, and the submitted case.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use crate::extract::caller::WorkPath;
use crate::extract::json::JsonBody;
use crate::limits::Memory;
use crate::problem::{Result, problems};
use crate::routes::submission::{JobAccepted, Submission, SubmitParameters};
use railhead_contact::case::words::solver::Case;

problems! {
    /// Problems of `POST /v1/jobs`.
    SubmitProblems: MalformedJson, UnreadableBody, BadQuery, BadHeader, BodyTimeout, BodyTooLarge, UnsupportedMediaType, UnsupportedEncoding, FaultyCase,
    IdempotencyConflict, QuotaExceeded, StoredQuotaExceeded, QueueFull, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

/// Submits one case as a job.
///
/// A job answered with `202` or `200` is stored durably. With `?wait=N` or `Prefer: wait=N`, the response is the ended job (`200`) if it
/// ends within N seconds, with its result or `error`. A case identical to one solved before (except for `name` and `labels`) succeeds at
/// once with that result, marked `cached`.
#[utoipa::path(
    post,
    path = "/v1/jobs",
    tag = "jobs",
    operation_id = "submit_job",
    params(SubmitParameters),
    request_body(content = Case, description = "One case", content_type = "application/json"),
    responses(JobAccepted, SubmitProblems)
)]
pub(crate) async fn submit(
    Submission {
        jobs,
        own: (),
        options,
        reply,
    }: Submission<()>,
    State(memory): State<Memory>,
    JsonBody { value, room }: JsonBody,
) -> Result<Response> {
    let (job, replayed) = jobs.submit_with(value, options).await?;
    drop(room);
    reply
        .send(&jobs, &memory, (job.into(), replayed), None)
        .await
}

problems! {
    /// Problems of one job.
    GetProblems: BadQuery, JobNotFound
}

/// Returns the case of a job, as it was submitted.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/case",
    tag = "jobs",
    operation_id = "get_case",
    params(("id" = String, Path, description = "Id of the job", format = "uuid")),
    responses((status = 200, description = "The case", body = Case), GetProblems)
)]
pub(crate) async fn case(WorkPath { jobs, id }: WorkPath) -> Result<Response> {
    let text = jobs.case(id).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}
