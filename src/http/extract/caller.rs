//! Who asks and for what: the tenant whose jobs a handler may reach, the operator of the service, and ids in paths.
use std::sync::Arc;
use std::time::Duration;

use axum::BoxError;
use axum::body::Bytes;
use axum::extract::{FromRequestParts, Path};
use axum::http::header;
use axum::http::request::Parts;
use futures_util::stream::{Stream, TryStreamExt, try_unfold};
use uuid::Uuid;

use crate::layers::auth::{bearer, unauthorized};
use crate::limits::HeldPermits;
use crate::problem::{ApiError, ProblemKind, Result};
use crate::state::AppState;
use railhead_jobs::Jobs;
use railhead_jobs::model::{ANONYMOUS, Kind, OPERATOR};

/// Whose request it is, once that is known; in its extensions.
#[derive(Debug, Clone)]
pub struct Tenant(pub Arc<str>);

/// The key of a request, which is checked again while its answer is being sent; in its extensions.
#[derive(Debug, Clone)]
pub struct Credential(Arc<str>);

/// How often the key of a long answer is checked again.
const POLL_INTERVAL: Duration = Duration::from_secs(2);

/// Ends when the key of a request has been revoked; never if the request has none.
pub async fn revoked(jobs: Jobs, credential: Option<Credential>) {
    let Some(Credential(text)) = credential else {
        return std::future::pending().await;
    };
    loop {
        tokio::time::sleep(POLL_INTERVAL).await;
        // A key table that does not answer does not count as a revocation.
        if matches!(jobs.key(&text).await, Ok(None)) {
            return;
        }
    }
}

/// The pieces of an answer. They break off once `revoked` ends, so that no client takes what was sent for all there is.
pub fn until_revoked<E: Into<BoxError>>(
    pieces: impl Stream<Item = Result<Bytes, E>> + Send,
    revoked: impl Future<Output = ()> + Send,
) -> impl Stream<Item = Result<Bytes, BoxError>> + Send {
    let state = (Box::pin(pieces), Box::pin(revoked));
    try_unfold(state, |(mut pieces, mut revoked)| async move {
        tokio::select! {
            biased;
            () = &mut revoked => Err("the key of the request was revoked".into()),
            piece = pieces.try_next() => {
                let piece = piece.map_err(Into::into)?;
                Ok(piece.map(|piece| (piece, (pieces, revoked))))
            }
        }
    })
}

/// The answer to a waiting request whose key was revoked.
pub(crate) fn revoked_meanwhile() -> ApiError {
    unauthorized("the key was revoked while the request waited")
}

/// The jobs that the client may see: those of its tenant. Every handler that touches jobs takes this.
#[derive(Debug, Clone)]
pub struct Caller(pub Jobs);

/// A client that may read the figures of the whole service.
#[derive(Debug, Clone)]
pub struct Operator(pub Jobs);

/// All jobs, for what concerns no tenant.
#[derive(Debug, Clone)]
pub struct AnyTenant(pub Jobs);

impl FromRequestParts<AppState> for Caller {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let access = &state.access;
        let (tenant, labels) = match access.key(parts).await? {
            Some(key) => (key.tenant, key.labels),
            None => (ANONYMOUS.into(), Arc::default()),
        };
        if let Some(held) = parts.extensions.get::<HeldPermits>() {
            held.add(state.concurrency.request(&tenant)?);
        }
        parts.extensions.insert(Tenant(tenant.clone()));
        let key = parts.headers.get(header::AUTHORIZATION);
        if let Some(key) = key.and_then(|header| bearer(header.to_str().ok()?)) {
            let credential = Credential(key.into());
            parts.extensions.insert(credential);
        }
        Ok(Caller(access.jobs.of(tenant).bound_to(labels)))
    }
}

impl FromRequestParts<AppState> for Operator {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let access = &state.access;
        match access.key(parts).await? {
            Some(key) if *key.tenant != *OPERATOR => Err(ApiError::new(
                ProblemKind::Forbidden,
                format!("only keys of the tenant `{OPERATOR}` may read this"),
            )),
            _ => Ok(Operator(access.jobs.clone())),
        }
    }
}

/// Declares the id in the path of a resource. A text that is no id names nothing, so it is answered like an unknown one.
macro_rules! id {
    ($(#[doc = $doc:literal])* $name:ident: $kind:ident) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy)]
        pub struct $name(pub Uuid);

        impl FromRequestParts<AppState> for $name {
            type Rejection = ApiError;

            async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
                read_id(parts, state, Kind::$kind).await.map($name)
            }
        }
    };
}

id! {
    /// The id of a job or an evolution.
    JobId: Case
}
id! {
    /// The id of a batch.
    BatchId: Cases
}
id! {
    /// The id of a run.
    RunId: Rows
}

/// The id of a run in the path, and the number of one of its rows.
#[derive(Debug, Clone, Copy)]
pub struct RunRowId(pub Uuid, pub u64);

impl FromRequestParts<AppState> for RunRowId {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let path = Path::<(String, String)>::from_request_parts(parts, state).await;
        let Path((id, row)) = path
            .map_err(|rejection| ApiError::new(ProblemKind::RunNotFound, rejection.body_text()))?;
        let id = work_id(Kind::Rows, &id)?;
        let number = row.parse().map_err(|_| {
            let detail = format!("`{row}` is not the index of a row; rows are counted from 0");
            ApiError::new(ProblemKind::RowNotFound, detail)
        })?;
        Ok(RunRowId(id, number))
    }
}

async fn read_id(parts: &mut Parts, state: &AppState, kind: Kind) -> Result<Uuid> {
    let path = Path::<String>::from_request_parts(parts, state).await;
    let Path(text) = path
        .map_err(|rejection| ApiError::new(ProblemKind::not_found(kind), rejection.body_text()))?;
    work_id(kind, &text)
}

/// Reads the id of work of this kind from a text.
///
/// # Errors
/// The text is not an id.
pub(crate) fn work_id(kind: Kind, text: &str) -> Result<Uuid> {
    let id = Uuid::try_parse(text).map_err(|_| {
        let detail = format!("`{text}` is not a {} id; ids are UUIDs", kind.noun());
        ApiError::new(ProblemKind::not_found(kind), detail)
    })?;
    if ProblemKind::not_found(kind) == ProblemKind::JobNotFound {
        tracing::Span::current().record("job", tracing::field::display(id));
    }
    Ok(id)
}
