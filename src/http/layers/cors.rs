//! Which other origins may read answers.

use std::time::Duration;

use axum::Router;
use axum::http::{HeaderName, HeaderValue, Method};
use tower_http::cors::{AllowOrigin, CorsLayer};

/// How long a browser may remember what it was allowed.
const PREFLIGHT_AGE: Duration = Duration::from_secs(600);

/// Lets pages of these origins read answers; without any, a browser lets no other origin read them.
pub fn allow_origins(router: Router, origins: Vec<HeaderValue>) -> Router {
    if origins.is_empty() {
        return router;
    }
    let known = |names: &[&'static str]| -> Vec<HeaderName> {
        names
            .iter()
            .map(|name| HeaderName::from_static(name))
            .collect()
    };
    router.layer(
        CorsLayer::new()
            .allow_origin(AllowOrigin::list(origins))
            .allow_methods([Method::GET, Method::POST, Method::DELETE])
            .allow_headers(known(&[
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
            ]))
            .expose_headers(known(&[
                "etag",
                "location",
                "idempotency-replayed",
                "link",
                "preference-applied",
                "ratelimit",
                "ratelimit-policy",
                "retry-after",
                "x-request-id",
            ]))
            .max_age(PREFLIGHT_AGE),
    )
}
