//! The sender of a request and the ids in its path: the tenant whose jobs a handler can access, and the operator of the service.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::BoxError;
use axum::body::Bytes;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use axum::http::{Extensions, header};
use futures_util::stream::{Stream, TryStreamExt, try_unfold};
use uuid::Uuid;

use crate::layers::auth::{bearer, unauthorized};
use crate::limits::HeldPermits;
use crate::problem::{ApiError, ProblemKind, Result};
use crate::state::AppState;
use railhead_jobs::Jobs;
use railhead_jobs::model::{ANONYMOUS, Kind, OPERATOR};

/// The tenant of a request, in its extensions once it is known.
#[derive(Debug, Clone)]
pub struct Tenant(pub Arc<str>);

impl Tenant {
    /// Returns the tenant of a request; empty before it is known.
    pub(crate) fn of(extensions: &Extensions) -> Arc<str> {
        let tenant = extensions.get::<Tenant>();
        tenant.map_or_else(|| "".into(), |Tenant(tenant)| tenant.clone())
    }
}

/// The API key of a request, in its extensions. It is checked again while a long response is sent.
#[derive(Debug, Clone)]
pub struct Credential(Arc<str>);

/// Interval between two checks of the key of a long response.
const POLL_INTERVAL: Duration = Duration::from_secs(2);

/// Resolves when the key of a request has been revoked; never if the request has no key.
pub async fn revoked(jobs: Jobs, credential: Option<Credential>) {
    let Some(Credential(text)) = credential else {
        return std::future::pending().await;
    };
    loop {
        tokio::time::sleep(POLL_INTERVAL).await;
        // A key table that does not respond does not count as a revocation.
        if matches!(jobs.key(&text).await, Ok(None)) {
            return;
        }
    }
}

/// Passes the pieces of a response on until `revoked` resolves. The stream then ends in an error, so that the client does not take it for
/// complete.
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

/// Returns the error of a waiting request whose key was revoked.
pub(crate) fn revoked_meanwhile() -> ApiError {
    unauthorized("the key was revoked while the request waited")
}

/// The jobs of the tenant of the request. Every handler that accesses jobs takes this.
#[derive(Debug, Clone)]
pub struct Caller(pub Jobs);

/// All jobs, for a client that may read the figures of the whole service.
#[derive(Debug, Clone)]
pub struct Operator(pub Jobs);

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

/// Every kind of work.
pub(crate) const KINDS: [Kind; 4] = [Kind::Case, Kind::Cases, Kind::Evolution, Kind::Rows];

/// The job, batch, run or evolution in the path `/v1/{kind}/{id}`.
#[derive(Debug, Clone)]
pub(crate) struct WorkPath {
    /// The jobs of the tenant, of the kind in the path.
    pub(crate) jobs: Jobs,
    /// The id. A text that is not an id is answered like an unknown id.
    pub(crate) id: Uuid,
}

impl FromRequestParts<AppState> for WorkPath {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let Caller(jobs) = Caller::from_request_parts(parts, state).await?;
        let nouns = parts.uri.path().split('/').nth(2);
        let kind = KINDS.into_iter().find(|kind| nouns == Some(kind.nouns()));
        let kind = kind.unwrap_or(Kind::Case);
        let unknown = ProblemKind::not_found(kind);
        let text = path_text(parts, state, "id", unknown).await?;
        let id = Uuid::try_parse(&text).map_err(|_| {
            let detail = format!(
                "`{text}` is not the id of any {}; ids are UUIDs",
                kind.noun()
            );
            ApiError::new(unknown, detail)
        })?;
        if unknown == ProblemKind::JobNotFound {
            tracing::Span::current().record("job", tracing::field::display(id));
        }
        let jobs = jobs.of_kind(kind);
        Ok(WorkPath { jobs, id })
    }
}

/// Returns a parameter of the path.
///
/// # Errors
/// A problem of the kind `unreadable`: a parameter is not UTF-8.
pub(crate) async fn path_text(
    parts: &mut Parts,
    state: &AppState,
    name: &str,
    unreadable: ProblemKind,
) -> Result<String> {
    let path = Path::<HashMap<String, String>>::from_request_parts(parts, state).await;
    let path = path.map_err(|rejection| ApiError::new(unreadable, rejection.body_text()));
    Ok(path?.0.remove(name).unwrap_or_default())
}
