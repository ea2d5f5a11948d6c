//! `/healthz` and `/readyz`: is the process alive, and can it take jobs?

use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::extract::caller::AnyTenant;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::error::JobsError;

/// A healthy answer.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Health {
    /// `alive` or `ready`.
    #[schema(value_type = String, example = "ready")]
    status: &'static str,
    /// Version of the service.
    #[schema(value_type = String)]
    version: &'static str,
}

impl Health {
    fn new(status: &'static str) -> Json<Health> {
        Json(Health {
            status,
            version: env!("CARGO_PKG_VERSION"),
        })
    }
}

/// Is the process alive? Asks nothing else.
#[utoipa::path(
    get,
    path = "/healthz",
    tag = "service",
    operation_id = "healthz",
    responses((status = 200, description = "The process is alive", body = Health))
)]
pub(crate) async fn alive() -> Json<Health> {
    Health::new("alive")
}

problems! {
    /// What `GET /readyz` can fail with.
    ReadyProblems: NotReady, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

/// Can the service take jobs? Asks the job store.
#[utoipa::path(
    get,
    path = "/readyz",
    tag = "service",
    operation_id = "readyz",
    responses((status = 200, description = "The service takes jobs", body = Health), ReadyProblems)
)]
pub(crate) async fn ready(
    State(AnyTenant(jobs)): State<AnyTenant>,
) -> Result<Json<Health>, ApiError> {
    match jobs.ready().await {
        Ok(()) => Ok(Health::new("ready")),
        Err(reason)
            if matches!(reason, JobsError::Draining) || reason.storage_fault().is_some() =>
        {
            Err(reason.into())
        }
        Err(reason) => {
            tracing::warn!(%reason, "the job store does not answer");
            Err(ApiError::new(
                ProblemKind::NotReady,
                "the job store cannot be reached; the service's log has the reason",
            ))
        }
    }
}
