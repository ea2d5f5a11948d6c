//! One span per request for a collector of traces, inside the trace of the client if it sends one.

use axum::Router;
use axum::extract::{MatchedPath, Request, State};
use axum::http::HeaderMap;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::Response;
use opentelemetry::KeyValue;
use opentelemetry::context::FutureExt;
use opentelemetry::trace::{Status, TraceContextExt};

use crate::layers::auth::PROBES;
use railhead_jobs::trace::Tracer;

/// Adds a layer that makes spans, if there is a tracer.
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
    if route.is_empty() || PROBES.contains(&route) {
        return next.run(request).await;
    }
    let method = request.method().as_str().to_owned();
    // The names follow the conventions of OpenTelemetry for HTTP.
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

/// Returns the value of a header that occurs once.
fn single<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    if values.next().is_some() {
        return None;
    }
    value.to_str().ok()
}
