//! What every request leaves in the log: one span with its request id, one line at its end, and panics by name.

use std::any::Any;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tower_http::classify::{ServerErrorsAsFailures, SharedClassifier};
use tower_http::trace::{DefaultOnFailure, DefaultOnRequest, MakeSpan, OnResponse, TraceLayer};
use tracing::{Span, field};
use uuid::Uuid;

use crate::http::problem::error::ApiError;

/// Header that carries the request id in both directions.
const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest request id taken over from a client.
const REQUEST_ID_MAX_CHARS: usize = 128;

/// Takes over the client's request id, or makes one, and repeats it in the answer. An id that is empty, too long or
/// not made of visible ASCII characters is replaced, because it goes into the log.
pub async fn carry_request_id(mut request: Request, next: Next) -> Response {
    let given = request
        .headers()
        .get(&REQUEST_ID)
        .filter(|id| fit_for_log(id))
        .cloned();
    let id = given.or_else(|| HeaderValue::from_str(&Uuid::now_v7().to_string()).ok());
    let Some(id) = id else {
        return next.run(request).await;
    };
    request.headers_mut().insert(REQUEST_ID, id.clone());
    let mut response = next.run(request).await;
    response.headers_mut().insert(REQUEST_ID, id);
    response
}

fn fit_for_log(id: &HeaderValue) -> bool {
    let bytes = id.as_bytes();
    !bytes.is_empty()
        && bytes.len() <= REQUEST_ID_MAX_CHARS
        && bytes.iter().all(u8::is_ascii_graphic)
}

/// One span per request, closed by one line with status and time.
pub fn span_layer()
-> TraceLayer<SharedClassifier<ServerErrorsAsFailures>, RequestSpan, DefaultOnRequest, LogResponse>
{
    TraceLayer::new_for_http()
        .make_span_with(RequestSpan)
        .on_response(LogResponse)
        .on_failure(DefaultOnFailure::new().level(tracing::Level::DEBUG))
}

/// Makes the span of a request.
#[derive(Debug, Clone, Copy)]
pub struct RequestSpan;

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
        tracing::info_span!(
            "request",
            request_id = id.unwrap_or_default(),
            method = %request.method(),
            path = request.uri().path(),
            route = route.unwrap_or_default(),
            job = field::Empty,
            tenant = field::Empty,
            key = field::Empty,
            trace_id = field::Empty,
        )
    }
}

/// Writes the line at the end of a request.
#[derive(Debug, Clone, Copy)]
pub struct LogResponse;

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

/// Turns a panic of a handler into an answer; the service lives on.
pub fn answer_panic(panic: Box<dyn Any + Send + 'static>) -> Response {
    let text = panic
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned());
    ApiError::internal(&format_args!("a handler panicked: {text}")).into_response()
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use axum::http::StatusCode;
    use axum::routing::get;
    use tower::ServiceExt;
    use tower_http::catch_panic::CatchPanicLayer;

    use super::*;
    use crate::http::problem::error::{PROBLEM_JSON, name_instance};

    fn panicking() -> Router {
        async fn handler() -> &'static str {
            panic!("a defect");
        }
        Router::new()
            .route("/broken", get(handler))
            .layer(CatchPanicLayer::custom(answer_panic))
            .layer(axum::middleware::from_fn(name_instance))
            .layer(span_layer())
            .layer(axum::middleware::from_fn(carry_request_id))
    }

    #[tokio::test]
    async fn a_panic_becomes_a_problem_that_keeps_its_reason() {
        let request = Request::get("/broken")
            .header("x-request-id", "abc")
            .body(Body::empty())
            .unwrap();
        let response = panicking().oneshot(request).await.unwrap();
        assert_eq!(response.status(), StatusCode::INTERNAL_SERVER_ERROR);
        assert_eq!(response.headers()["content-type"], PROBLEM_JSON);
        assert_eq!(response.headers()["x-request-id"], "abc");
        let body = axum::body::to_bytes(response.into_body(), 10_000)
            .await
            .unwrap();
        let problem: serde_json::Value = serde_json::from_slice(&body).unwrap();
        assert_eq!(problem["type"], "/problems/internal");
        assert_eq!(problem["instance"], "/broken");
        assert!(
            !problem["detail"].as_str().unwrap().contains("defect"),
            "the reason belongs to the log"
        );
    }

    #[tokio::test]
    async fn a_request_id_unfit_for_the_log_is_replaced() {
        for id in ["", "two words", &"x".repeat(129)] {
            let request = Request::get("/broken")
                .header("x-request-id", id)
                .body(Body::empty())
                .unwrap();
            let response = panicking().oneshot(request).await.unwrap();
            let answered = response.headers()["x-request-id"].to_str().unwrap();
            assert!(
                Uuid::parse_str(answered).is_ok(),
                "{id:?} was answered by {answered:?}"
            );
        }
    }
}
