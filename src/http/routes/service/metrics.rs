//! `/metrics`: what the service counts, for Prometheus.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

use crate::http::extract::caller::Operator;
use crate::http::layers::metrics::Metrics;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;

/// The text form that Prometheus asks for first.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

problems! {
    /// What `GET /metrics` can fail with.
    MetricsProblems: Unauthorized, Forbidden, TooManyRequests
}

/// What the service counts, as OpenMetrics text.
///
/// Every name begins with `railhead_`. Labels have few values; none holds an id or a text of a client.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "service",
    operation_id = "get_metrics",
    responses((status = 200, description = "The figures", body = String, content_type = "application/openmetrics-text"), MetricsProblems)
)]
pub async fn metrics(
    Operator(jobs): Operator,
    State(metrics): State<Metrics>,
) -> Result<Response, ApiError> {
    jobs.refresh_metrics().await?;
    let mut text = String::new();
    metrics
        .write(&mut text)
        .map_err(|error| ApiError::internal(&error))?;
    Ok(([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response())
}
