//! What every request leaves in the log: one span with its request id, and one line at its end.

use std::time::Duration;

use axum::body::Body;
use axum::extract::MatchedPath;
use axum::response::Response;
use tower_http::classify::{ServerErrorsAsFailures, SharedClassifier};
use tower_http::trace::{DefaultOnFailure, DefaultOnRequest, MakeSpan, OnResponse, TraceLayer};
use tracing::{Span, field};

use crate::http::layers::request_id::REQUEST_ID;
use crate::http::server::connections::Peer;

/// One span per request, closed by one line with status and time.
pub(crate) fn span_layer()
-> TraceLayer<SharedClassifier<ServerErrorsAsFailures>, RequestSpan, DefaultOnRequest, LogResponse>
{
    TraceLayer::new_for_http()
        .make_span_with(RequestSpan)
        .on_response(LogResponse)
        .on_failure(DefaultOnFailure::new().level(tracing::Level::DEBUG))
}

/// Makes the span of a request.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RequestSpan;

impl MakeSpan<Body> for RequestSpan {
    fn make_span(&mut self, request: &axum::http::Request<Body>) -> Span {
        let id = request
            .headers()
            .get(&REQUEST_ID)
            .and_then(|id| id.to_str().ok());
        let route = request
            .extensions()
            .get::<MatchedPath>()
            .map(MatchedPath::as_str);
        let span = tracing::info_span!(
            "request",
            request_id = id.unwrap_or_default(),
            method = %request.method(),
            path = request.uri().path(),
            route = route.unwrap_or_default(),
            job = field::Empty,
            tenant = field::Empty,
            key = field::Empty,
            trace_id = field::Empty,
            client = field::Empty,
        );
        if let Some(Peer(client)) = request.extensions().get() {
            span.record("client", field::display(client));
        }
        span
    }
}

/// Writes the line at the end of a request.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogResponse;

impl OnResponse<Body> for LogResponse {
    fn on_response(self, response: &Response, latency: Duration, _span: &Span) {
        let status = response.status().as_u16();
        let seconds = latency.as_secs_f64();
        if response.status().is_server_error() {
            tracing::warn!(status, seconds, "answered");
        } else {
            tracing::info!(status, seconds, "answered");
        }
    }
}
