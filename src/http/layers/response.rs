//! Layers for responses: a final line break, compression, headers for browsers, and panics as problems.

use std::any::Any;
use std::convert::Infallible;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::{
    Extensions, HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Version, header,
};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, TryStreamExt, stream};
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::set_header::SetResponseHeaderLayer;

use crate::layers::admission::declared_length;
use crate::problem::ApiError;

/// Layer that appends a line break to JSON, inside compression.
pub(crate) async fn end_line(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    let media_type = response.headers().get(header::CONTENT_TYPE);
    let is_json = media_type.and_then(|value| value.to_str().ok());
    let is_json = is_json.is_some_and(|value| {
        value.starts_with("application/json") || value.starts_with("application/problem+json")
    });
    if !is_json || response.status() == StatusCode::NOT_MODIFIED {
        return response;
    }
    let declared = declared_length(response.headers());
    if let Some(size) = declared.or_else(|| response.body().size_hint().exact()) {
        let size = HeaderValue::from(size + 1);
        response.headers_mut().insert(header::CONTENT_LENGTH, size);
    }
    // An outer layer drops the body of a response to HEAD.
    response.map(|body| {
        let newline = stream::once(async { Ok::<_, Infallible>(Bytes::from_static(b"\n")) });
        let newline = newline.map_err(axum::Error::new);
        Body::from_stream(body.into_data_stream().chain(newline))
    })
}

/// Size in bytes up to which a body is not compressed.
const SMALLEST: u64 = 256;

/// Marks a response whose lines must be sent at once; compression would delay them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StreamedUnbuffered;

/// Layer that compresses responses, except compressed formats and responses marked [`StreamedUnbuffered`].
pub(crate) fn compression_layer() -> CompressionLayer<impl Predicate> {
    let not_live = |_: StatusCode, _: Version, _: &HeaderMap, extensions: &Extensions| {
        extensions.get::<StreamedUnbuffered>().is_none()
    };
    CompressionLayer::new().gzip(true).zstd(true).compress_when(
        SizeAbove::new(SMALLEST)
            .and(NotForContentType::SSE)
            .and(NotForContentType::const_new("image/png"))
            .and(NotForContentType::const_new("application/x-npz"))
            .and(not_live),
    )
}

/// Policy for the readable contract, whose page contains a part of its styles.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
     object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

const FIXED: [(HeaderName, &str); 4] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
];

/// Adds the fixed headers to every response that does not have them.
pub(crate) fn secure<S: Clone + Send + Sync + 'static>(router: Router<S>) -> Router<S> {
    FIXED.into_iter().fold(router, |router, (name, value)| {
        let value = HeaderValue::from_static(value);
        router.layer(SetResponseHeaderLayer::if_not_present(name, value))
    })
}

/// Answers a panic of a handler.
pub(crate) fn answer_panic(panic: Box<dyn Any + Send + 'static>) -> Response {
    let text = panic
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no panic message".to_owned());
    ApiError::internal(format_args!("a handler panicked: {text}")).into_response()
}

/// Time for which a browser may cache a preflight response.
const PREFLIGHT_AGE: Duration = Duration::from_secs(600);

/// Allows pages of these origins to read responses. Without origins, browsers do not allow other pages to.
pub fn allow_origins(router: Router, origins: Vec<HeaderValue>) -> Router {
    if origins.is_empty() {
        return router;
    }
    router.layer(
        CorsLayer::new()
            .allow_origin(AllowOrigin::list(origins))
            .allow_methods([Method::GET, Method::POST, Method::DELETE])
            .allow_headers(
                [
                    "accept",
                    "authorization",
                    "cache-control",
                    "content-encoding",
                    "content-type",
                    "idempotency-key",
                    "if-none-match",
                    "last-event-id",
                    "prefer",
                    "traceparent",
                    "tracestate",
                    "x-request-id",
                ]
                .map(HeaderName::from_static),
            )
            .expose_headers(
                [
                    "etag",
                    "location",
                    "idempotency-replayed",
                    "link",
                    "preference-applied",
                    "ratelimit",
                    "ratelimit-policy",
                    "retry-after",
                    "x-request-id",
                ]
                .map(HeaderName::from_static),
            )
            .max_age(PREFLIGHT_AGE),
    )
}

#[cfg(test)]
mod tests {
    use axum::Router;
    use axum::body::Body;
    use axum::extract::Request;
    use axum::http::StatusCode;
    use axum::routing::get;
    use tower::ServiceExt;
    use tower_http::catch_panic::CatchPanicLayer;

    use super::*;
    use crate::layers::request_log::{carry_request_id, span_layer};
    use crate::problem::{PROBLEM_JSON, name_instance};

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
}
