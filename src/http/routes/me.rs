//! `GET /v1/me`: who asks, what it uses, and what it may use.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::dto::tenant_limits::TenantLimits;
use crate::http::extract::caller::Caller;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::PlainProblems;
use crate::http::problem::error::ApiError;
use crate::jobs::model::job::State as JobState;

/// Who asks, what it uses, and what it may use.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Me {
    /// The tenant that the key belongs to; `anonymous` without a key.
    tenant: String,
    /// Labels that the key is bound to: the key can access only resources with these labels, and resources created with it get them.
    labels: BTreeMap<String, String>,
    /// What the tenant may use at most.
    quota: Quota,
    /// What the tenant uses at present.
    used: Used,
    /// Limits of requests.
    limits: TenantLimits,
}

/// What a tenant may use at most.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Quota {
    /// Queued jobs and chunks of runs, with those of batches that are being received.
    queued: u64,
    /// Bytes reserved for batches that are being received.
    staged_bytes: u64,
    /// Bytes of stored cases, templates and results; null: any number.
    stored_bytes: Option<u64>,
}

/// What a tenant uses at present.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Used {
    /// Queued jobs and chunks of runs, with the places that are reserved for batches being received.
    queued: u64,
    /// Bytes reserved for batches that are being received.
    staged_bytes: u64,
    /// Bytes of stored cases, templates and results.
    stored_bytes: u64,
    /// Number of its jobs in each state, the chunks of its runs included.
    #[schema(value_type = BTreeMap<String, u64>)]
    jobs: BTreeMap<&'static str, u64>,
}

/// Returns the client's tenant, its use and its limits.
#[utoipa::path(
    get,
    path = "/v1/me",
    tag = "service",
    operation_id = "get_me",
    responses((status = 200, description = "The tenant with its use and its limits", body = Me), PlainProblems)
)]
pub(crate) async fn me(
    Caller(jobs): Caller,
    State(options): State<HttpOptions>,
) -> Result<Json<Me>, ApiError> {
    let own = jobs.options();
    let usage = jobs.usage().await?;
    let number = |state| usage.jobs.get(&state).copied().unwrap_or(0);
    Ok(Json(Me {
        tenant: jobs.tenant().to_owned(),
        labels: jobs.bound().clone(),
        quota: Quota {
            queued: own.tenant_queue_max.min(own.queue_max),
            staged_bytes: own.staging.tenant.min(own.staging.all),
            stored_bytes: own.tenant_stored_max_bytes,
        },
        used: Used {
            queued: number(JobState::Queued) + usage.reserved,
            staged_bytes: usage.staged_bytes,
            stored_bytes: usage.stored_bytes,
            jobs: JobState::ALL
                .map(|state| (state.name(), number(state)))
                .into(),
        },
        limits: TenantLimits::of(&options),
    }))
}
