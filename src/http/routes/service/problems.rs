//! `/problems`: what each kind of problem means, for people who follow a problem's `type`.

use axum::Json;
use axum::extract::Path;

use crate::http::problem::catalogue::{PlainProblems, ProblemMeaning, problems};
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

problems! {
    /// What `GET /problems/{name}` can fail with.
    ExplainProblems: BadQuery, UnknownRoute
}

/// Every kind of problem that this service knows.
#[utoipa::path(
    get,
    path = "/problems",
    tag = "service",
    operation_id = "list_problems",
    responses((status = 200, description = "All kinds of problems", body = Vec<ProblemMeaning>), PlainProblems)
)]
pub(crate) async fn list() -> Json<Vec<ProblemMeaning>> {
    Json(
        ProblemKind::ALL
            .iter()
            .copied()
            .map(ProblemMeaning::from)
            .collect(),
    )
}

/// One kind of problem, explained; a problem's `type` leads here.
#[utoipa::path(
    get,
    path = "/problems/{name}",
    tag = "service",
    operation_id = "explain_problem",
    params(("name" = String, Path, description = "The last part of a problem's `type`", example = "faulty-case")),
    responses((status = 200, description = "What this kind of problem means", body = ProblemMeaning), ExplainProblems)
)]
pub(crate) async fn explain(Path(name): Path<String>) -> Result<Json<ProblemMeaning>, ApiError> {
    let known = ProblemKind::ALL
        .iter()
        .copied()
        .find(|kind| kind.slug() == name);
    known.map(|kind| Json(kind.into())).ok_or_else(|| {
        ApiError::new(
            ProblemKind::UnknownRoute,
            format!("`{name}` is no kind of problem; `/problems` lists them all"),
        )
    })
}
