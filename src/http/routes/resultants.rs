//! `/v1/jobs/{id}/resultants`: forces and moments, per patch and in sum, as JSON or as a table.

use axum::response::Response;

use crate::contact::solution::words::answer::Solution;
use crate::http::dto::resultants::{Resultants, sums};
use crate::http::extract::accept::{choose, one_of};
use crate::http::extract::query::{Parameters, index, query, require_index};
use crate::http::limits::holding_body::hold_while_sent;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::render::resultants::csv;
use crate::http::routes::part_request::PartRequest;

problems! {
    /// What parts of a result can fail with.
    PartProblems: BadQuery, JobNotFound, ResultNotReady, JobFailed, JobCancelled
}

/// The forms that resultants come in.
const FORMATS: &[Format] = &[Format::Json, Format::Csv];

query! {
    /// Parameters of resultants.
    ResultantsQuery(() => ()) {
        /// Only this motion, counted from 0
        point: usize as u32 = index();
        /// Only this patch, counted from 0; `total` stays the sum over all
        patch: usize as u32 = index();
        /// `json` or `csv`; overrides `Accept`
        #[param(pattern = "^(json|csv)$", example = "csv")]
        format: Format as String = one_of(FORMATS);
    }
}

/// Forces and moments of a succeeded job. They are always computed, whatever the case asked for.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/resultants",
    tag = "results",
    operation_id = "get_resultants",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ResultantsQuery
    ),
    responses((status = 200, description = "Forces and moments on the lower body. CSV: one line per patch and motion, then one per motion with `total` as its patch", content((Resultants = "application/json"), (String = "text/csv"))), PartProblems)
)]
pub(crate) async fn resultants(request: PartRequest) -> Result<Response, ApiError> {
    let query = ResultantsQuery::read(&request.uri, &())?;
    let format = choose(&request.headers, query.format, FORMATS)?;
    let answer = write(&request, query.point, query.patch, format);
    request.unless_known(format, answer).await
}

async fn write(
    request: &PartRequest,
    point: Option<usize>,
    patch: Option<usize>,
    format: Format,
) -> Result<Response, ApiError> {
    let (jobs, id) = (&request.jobs, request.id);
    // The stored text is read whole and cut to what was asked for.
    let turn = request.rendering(2 * jobs.answer_bytes(id).await?).await?;
    let text = jobs.answer(id).await?;
    let read = move || {
        let solution: Solution =
            serde_json::from_slice(&text).map_err(|error| ApiError::internal(&error))?;
        drop(text);
        require_index("point", point, solution.total.len())?;
        require_index("patch", patch, solution.patches.len())?;
        let sums = sums(&solution);
        let resultants = Resultants::select(solution, point, patch);
        match format {
            Format::Csv => csv(&resultants, &sums).map_err(|error| ApiError::internal(&error)),
            _ => serde_json::to_vec(&resultants).map_err(|error| ApiError::internal(&error)),
        }
    };
    let (body, share) = turn.run(read, Vec::len).await?;
    let response = format.answer("resultants", body);
    Ok(hold_while_sent(response, share))
}
