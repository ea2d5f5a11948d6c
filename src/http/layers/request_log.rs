//! The id of a request, and its line in the log.

use std::time::Duration;

use axum::extract::{MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;
use tower_http::classify::{ServerErrorsAsFailures, SharedClassifier};
use tower_http::trace::{DefaultOnFailure, DefaultOnRequest, TraceLayer};
use tracing::{Span, field};
use uuid::Uuid;

use crate::server::connections::Peer;

/// Header with the id of a request, in requests and responses.
pub(crate) const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Longest id that is accepted from a client.
const REQUEST_ID_MAX_CHARS: usize = 128;

/// Layer that accepts the id of the client, or creates one, and returns it in the response. An id that is empty, too long or does not
/// consist of visible ASCII characters is replaced, because it is written to the log.
pub(crate) async fn carry_request_id(mut request: Request, next: Next) -> Response {
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

type SpanLayer = TraceLayer<
    SharedClassifier<ServerErrorsAsFailures>,
    fn(&Request) -> Span,
    DefaultOnRequest,
    fn(&Response, Duration, &Span),
>;

/// Layer with a span for each request, which ends with a log line with status and time.
pub(crate) fn span_layer() -> SpanLayer {
    TraceLayer::new_for_http()
        .make_span_with(request_span as fn(&Request) -> Span)
        .on_response(log_response as fn(&Response, Duration, &Span))
        .on_failure(DefaultOnFailure::new().level(tracing::Level::DEBUG))
}

fn request_span(request: &Request) -> Span {
    let id = request.headers().get(&REQUEST_ID);
    let route = request.extensions().get::<MatchedPath>();
    let span = tracing::info_span!(
        "request",
        request_id = id.and_then(|id| id.to_str().ok()).unwrap_or_default(),
        method = %request.method(),
        path = request.uri().path(),
        route = route.map(MatchedPath::as_str).unwrap_or_default(),
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

fn log_response(response: &Response, latency: Duration, _span: &Span) {
    let status = response.status().as_u16();
    let seconds = latency.as_secs_f64();
    if response.status().is_server_error() {
        tracing::warn!(status, seconds, "answered");
    } else {
        tracing::info!(status, seconds, "answered");
    }
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use axum::routing::get;
    use tower::ServiceExt;

    use super::*;

    fn router() -> Router {
        Router::new()
            .route("/", get(async || "answer"))
            .layer(axum::middleware::from_fn(carry_request_id))
    }

    #[tokio::test]
    async fn a_request_id_unfit_for_the_log_is_replaced() {
        for id in ["", "two words", &"x".repeat(129)] {
            let request = Request::get("/")
                .header("x-request-id", id)
                .body(axum::body::Body::empty())
                .unwrap();
            let response = router().oneshot(request).await.unwrap();
            let answered = response.headers()["x-request-id"].to_str().unwrap();
            assert!(
                Uuid::parse_str(answered).is_ok(),
                "{id:?} was answered by {answered:?}"
            );
        }
    }
}
