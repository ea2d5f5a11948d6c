//! The ids of jobs, batches and runs in paths.

use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use uuid::Uuid;

use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

/// Declares the id in the path of a resource. A text that is no id names nothing, so it is answered like an unknown one.
macro_rules! id {
    ($(#[doc = $doc:literal])* $name:ident: $problem:ident, $noun:literal) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy)]
        pub struct $name(pub Uuid);

        impl<S: Send + Sync> FromRequestParts<S> for $name {
            type Rejection = ApiError;

            async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
                read_id(parts, state, ProblemKind::$problem, $noun).await.map($name)
            }
        }
    };
}

id! {
    /// The id of a job or an evolution.
    JobId: JobNotFound, "job"
}
id! {
    /// The id of a batch.
    BatchId: BatchNotFound, "batch"
}
id! {
    /// The id of a run.
    RunId: RunNotFound, "run"
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
    let id = parsed(&text, kind, what)?;
    if kind == ProblemKind::JobNotFound {
        tracing::Span::current().record("job", tracing::field::display(id));
    }
    Ok(id)
}

/// The id that a text is.
///
/// # Errors
/// The text is none: `kind`.
pub(crate) fn parsed(text: &str, kind: ProblemKind, what: &str) -> Result<Uuid, ApiError> {
    Uuid::try_parse(text)
        .map_err(|_| ApiError::new(kind, format!("`{text}` is no {what} id; ids are UUIDs")))
}
