//! `/v1/jobs/{id}/result`: everything small about the answer of a job.

use std::collections::BTreeMap;

use axum::extract::State;
use axum::http::{HeaderMap, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::Output;
use crate::contact::solution::Solution;
use crate::http::accept::Format;
use crate::http::access::Caller;
use crate::http::caching::{Known, tagged};
use crate::http::carrying::carrying;
use crate::http::error::{ApiError, Kind};
use crate::http::job::JobId;
use crate::http::memory::Memory;
use crate::http::problems::problems;
use crate::http::query::{Query, whole};
use crate::jobs::Jobs;

/// The result of a job: the solution without its fields, and where to get those.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobResult {
    #[serde(flatten)]
    solution: Solution,
    /// The result was computed for an identical case before; `seconds` are those of that solve.
    cached: bool,
    /// The job, and every part of the result that the case asked for.
    links: BTreeMap<String, String>,
}

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
    Ok(tagged(&tag, carrying((head, text).into_response(), share)))
}

/// The result of a succeeded job with its links.
///
/// # Errors
/// The job is unknown, has not ended or has no result.
pub async fn result_of(jobs: &Jobs, id: Uuid) -> Result<JobResult, ApiError> {
    let answer = jobs.answer(id).await?;
    let outputs: Vec<&str> = answer.outputs.into_iter().map(name_of).collect();
    Ok(JobResult {
        solution: answer.solution,
        cached: answer.cached,
        links: JobResult::links(id, &outputs),
    })
}

impl JobResult {
    /// The links of the result of a job whose case asked for these outputs.
    #[must_use]
    pub fn links(id: Uuid, outputs: &[impl AsRef<str>]) -> BTreeMap<String, String> {
        let own = format!("/v1/jobs/{id}");
        let mut links = BTreeMap::from([("resultants".to_owned(), format!("{own}/resultants"))]);
        for name in outputs.iter().map(AsRef::as_ref) {
            links.insert(name.to_owned(), format!("{own}/{name}"));
        }
        links.insert("job".to_owned(), own);
        links
    }
}

/// What a number of a motion or a patch may be.
pub const INDEX: &str = "a whole number, counted from 0";

/// Reads the number of a motion or a patch.
#[must_use]
pub fn index(text: &str) -> Option<usize> {
    whole(text, 0, u32::MAX).and_then(|number| usize::try_from(number).ok())
}

/// Is the number of a motion or patch, if one is given, one of `count`?
///
/// # Errors
/// `bad-query` naming the parameter, its value and the largest number allowed.
pub fn require_index(name: &str, index: Option<usize>, count: usize) -> Result<(), ApiError> {
    match index {
        Some(index) if index >= count => Err(ApiError::bad_parameter(
            name,
            format!(
                "`{name}` is `{index}`; allowed: 0 to {}",
                count.saturating_sub(1)
            ),
        )),
        _ => Ok(()),
    }
}

/// The failure of a client that fetches what its case did not ask for.
///
/// # Errors
/// Always: `output-not-asked`, or what went wrong while finding out.
pub async fn not_asked<T>(jobs: &Jobs, id: Uuid, output: Output) -> Result<T, ApiError> {
    let asked: Vec<String> = jobs
        .outputs(id)
        .await?
        .into_iter()
        .map(|output| format!("`{}`", name_of(output)))
        .collect();
    let name = name_of(output);
    Err(ApiError::new(
        Kind::OutputNotAsked,
        format!(
            "the case asked for {} only; submit it again with `{name}` among its `outputs`",
            asked.join(", ")
        ),
    ))
}

/// The word of an output, in `outputs` and as the last part of its path.
#[must_use]
pub fn name_of(output: Output) -> &'static str {
    match output {
        Output::Resultants => "resultants",
        Output::Zones => "zones",
        Output::Tractions => "tractions",
        Output::Pressure => "pressure",
        Output::Slip => "slip",
    }
}
