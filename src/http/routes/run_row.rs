//! `/v1/runs/{id}/rows/{row}`: one row of a run, the case that it stands for and what became of it.

use axum::Json;
use serde::Serialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::http::extract::caller::Caller;
use crate::http::extract::ids::RunRowId;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::row_tables::RowWriter;
use crate::jobs::codec::table::RowTable;

problems! {
    /// What one row of a run can fail with.
    RunRowProblems: BadQuery, RunNotFound, RowNotFound, Expired
}

/// A row of a run by itself.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunRowAlone {
    /// Number of the row in what was sent, counted from 0.
    row: u64,
    /// The case that the row stands for: the template with the values of the row in their places. Submitted as a job it has the values per cell
    /// that a run leaves out.
    #[schema(value_type = Object)]
    case: Value,
    /// The row of the results, by the names of their columns; null while it is not solved.
    #[schema(value_type = Option<Object>)]
    answer: Option<Map<String, Value>>,
}

/// One row of a run: the case that it stands for, and its answer as soon as it is there.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/rows/{row}",
    tag = "runs",
    operation_id = "get_run_row",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        ("row" = u64, Path, description = "Number of the row, counted from 0", minimum = 0)
    ),
    responses((status = 200, description = "The row", body = RunRowAlone), RunRowProblems)
)]
pub(crate) async fn row(
    Caller(jobs): Caller,
    RunRowId(id, row): RunRowId,
) -> Result<Json<RunRowAlone>, ApiError> {
    let run = jobs.run(id).await?;
    if row >= run.head.rows {
        return Err(ApiError::new(
            ProblemKind::RowNotFound,
            format!("the run has {} rows, counted from 0", run.head.rows),
        ));
    }
    let (case, answer) = jobs.run_row(&run, row).await?;
    let answer = answer.map(members).transpose()?;
    Ok(Json(RunRowAlone { row, case, answer }))
}

/// The only row of a table as the lines of the results have it.
fn members(table: RowTable) -> Result<Map<String, Value>, ApiError> {
    let line = RowWriter::Ndjson.write(table);
    let line = line.map_err(|error| ApiError::internal(&error))?;
    serde_json::from_slice(&line).map_err(|error| ApiError::internal(&error))
}
