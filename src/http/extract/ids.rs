//! The ids of jobs, batches and runs in paths.

use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use uuid::Uuid;

use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

/// The id in the path. A text that is no id names no job, so it is answered like an unknown one.
#[derive(Debug, Clone, Copy)]
pub struct JobId(pub Uuid);

impl<S: Send + Sync> FromRequestParts<S> for JobId {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let id = read_id(parts, state, ProblemKind::JobNotFound, "job").await?;
        tracing::Span::current().record("job", tracing::field::display(id));
        Ok(JobId(id))
    }
}

/// The id of a batch in the path.
#[derive(Debug, Clone, Copy)]
pub struct BatchId(pub Uuid);

impl<S: Send + Sync> FromRequestParts<S> for BatchId {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let id = read_id(parts, state, ProblemKind::BatchNotFound, "batch").await?;
        Ok(BatchId(id))
    }
}

/// The id of a run in the path.
#[derive(Debug, Clone, Copy)]
pub struct RunId(pub Uuid);

impl<S: Send + Sync> FromRequestParts<S> for RunId {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let id = read_id(parts, state, ProblemKind::RunNotFound, "run").await?;
        Ok(RunId(id))
    }
}

/// The id of a run in the path, and the number of one of its rows.
#[derive(Debug, Clone, Copy)]
pub struct RunRowId(pub Uuid, pub u64);

impl<S: Send + Sync> FromRequestParts<S> for RunRowId {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let path = Path::<(String, String)>::from_request_parts(parts, state).await;
        let Path((id, row)) = path
            .map_err(|rejection| ApiError::new(ProblemKind::RunNotFound, rejection.body_text()))?;
        let id = parsed(&id, ProblemKind::RunNotFound, "run")?;
        let number = row.parse().map_err(|_| {
            let detail = format!("`{row}` is no number of a row; rows are counted from 0");
            ApiError::new(ProblemKind::RowNotFound, detail)
        })?;
        Ok(RunRowId(id, number))
    }
}

async fn read_id<S: Send + Sync>(
    parts: &mut Parts,
    state: &S,
    kind: ProblemKind,
    what: &str,
) -> Result<Uuid, ApiError> {
    let Path(text) = Path::<String>::from_request_parts(parts, state)
        .await
        .map_err(|rejection| ApiError::new(kind, rejection.body_text()))?;
    parsed(&text, kind, what)
}

/// The id that a text is.
///
/// # Errors
/// The text is none: `kind`.
pub(crate) fn parsed(text: &str, kind: ProblemKind, what: &str) -> Result<Uuid, ApiError> {
    Uuid::try_parse(text)
        .map_err(|_| ApiError::new(kind, format!("`{text}` is no {what} id; ids are UUIDs")))
}
