//! `/v1/examples`: cases to begin with.

use axum::Json;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Case;
use crate::http::examples::EXAMPLES;
use crate::http::problem::catalogue::PlainProblems;
use crate::http::problem::error::ApiError;

/// A case to begin with.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ExampleCase {
    /// Its name, as in `api/examples/{name}.case.json`.
    #[schema(value_type = String)]
    name: &'static str,
    /// What it shows.
    #[schema(value_type = String)]
    summary: &'static str,
    /// The case, ready to be submitted.
    #[schema(value_type = Case)]
    case: Value,
}

/// Cases to begin with, each ready to be submitted.
#[utoipa::path(
    get,
    path = "/v1/examples",
    tag = "cases",
    operation_id = "list_examples",
    responses((status = 200, description = "All examples", body = Vec<ExampleCase>), PlainProblems)
)]
pub(crate) async fn examples() -> Result<Json<Vec<ExampleCase>>, ApiError> {
    let read = |(name, summary, text): (&'static str, &'static str, &str)| {
        let case = serde_json::from_str(text);
        let case = case.map_err(|error| ApiError::internal(&error))?;
        Ok(ExampleCase {
            name,
            summary,
            case,
        })
    };
    EXAMPLES
        .into_iter()
        .map(read)
        .collect::<Result<_, _>>()
        .map(Json)
}
