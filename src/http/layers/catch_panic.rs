//! A panic of a handler becomes an answer; its reason goes to the log.

use std::any::Any;

use axum::response::{IntoResponse, Response};

use crate::http::problem::error::ApiError;

/// Turns a panic of a handler into an answer; the service lives on.
pub(crate) fn answer_panic(panic: Box<dyn Any + Send + 'static>) -> Response {
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
    use axum::body::Body;
    use axum::extract::Request;
    use axum::http::StatusCode;
    use axum::routing::get;
    use tower::ServiceExt;
    use tower_http::catch_panic::CatchPanicLayer;

    use super::*;
    use crate::http::layers::request_id::carry_request_id;
    use crate::http::layers::request_log::span_layer;
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
}
