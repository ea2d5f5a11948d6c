//! One span per request for those who collect traces; inside the client's trace if it sends one.

use axum::Router;
use axum::extract::{MatchedPath, Request, State};
use axum::http::HeaderMap;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use opentelemetry::KeyValue;
use opentelemetry::context::FutureExt;
use opentelemetry::trace::{Status, TraceContextExt};

use railhead_jobs::trace::Tracer;

/// Routes that are asked every few seconds and tell nothing new.
const UNTRACED: [&str; 3] = ["/healthz", "/readyz", "/metrics"];

/// Makes spans of requests, if there is something to make them with; else the router stays as it is.
pub(crate) fn trace<S: Clone + Send + Sync + 'static>(
    router: Router<S>,
    tracer: Option<&Tracer>,
) -> Router<S> {
    match tracer {
        Some(tracer) => router.layer(from_fn_with_state(tracer.clone(), trace_request)),
        None => router,
    }
}

async fn trace_request(State(tracer): State<Tracer>, request: Request, next: Next) -> Response {
    let matched = request.extensions().get::<MatchedPath>();
    let route = matched.map(MatchedPath::as_str).unwrap_or_default();
    if route.is_empty() || UNTRACED.contains(&route) {
        return next.run(request).await;
    }
    let method = request.method().as_str().to_owned();
    // Names as OpenTelemetry's conventions for HTTP have them.
    let context = tracer.request(
        format!("{method} {route}"),
        single(request.headers(), "traceparent"),
        single(request.headers(), "tracestate"),
        vec![
            KeyValue::new("http.request.method", method),
            KeyValue::new("http.route", route.to_owned()),
        ],
    );
    let trace = context.span().span_context().trace_id();
    tracing::Span::current().record("trace_id", tracing::field::display(trace));
    let response = next.run(request).with_context(context.clone()).await;
    let status = response.status();
    let span = context.span();
    span.set_attribute(KeyValue::new(
        "http.response.status_code",
        i64::from(status.as_u16()),
    ));
    if status.is_server_error() {
        span.set_status(Status::error(""));
    }
    span.end();
    response
}

/// The value of a header that is there once.
fn single<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    if values.next().is_some() {
        return None;
    }
    value.to_str().ok()
}
