//! What may a client ask? The route list, the limits and the layers around every request.
//!
//! Handlers translate: they read a request, call [`Jobs`] and answer. Nothing is computed here.

mod accept;
mod access;
mod batch_body;
mod batch_results;
mod batches;
pub mod body;
mod caching;
mod cases;
mod cells;
mod coding;
mod connections;
pub mod elements;
mod error;
mod events;
mod fields;
mod formats;
mod headers;
mod health;
mod job;
mod jobs;
mod methods;
mod metrics;
mod openapi;
mod picture;
mod plot;
mod problem;
mod problems;
mod query;
mod resultants;
mod results;
mod spans;
pub mod table_body;
mod trace;
mod unread;
mod wishes;
mod write_limit;
mod zones;

use std::time::Duration;

use axum::Router;
use axum::extract::{DefaultBodyLimit, FromRef};
use axum::http::Uri;
use axum::middleware::{from_fn, from_fn_with_state};
use axum::response::Redirect;
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::decompression::RequestDecompressionLayer;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::{Config, SwaggerUi};

use crate::http::access::{Access, Unscoped};
use crate::http::error::{ApiError, Kind};
use crate::jobs::Jobs;

pub use crate::http::access::Peer;
pub use crate::http::connections::serve;
pub use crate::http::headers::allow_origins;
pub use crate::http::openapi::openapi_json;

/// What one request may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HttpOptions {
    /// Largest body of one case in bytes.
    pub body_max_bytes: usize,
    /// Time for the next request's head to arrive on a connection, idle time included.
    pub head_timeout: Duration,
    /// Time for a body to arrive whole; for a batch, time between two pieces, and the head start over its lowest rate.
    pub body_timeout: Duration,
    /// How long a client may take nothing of its answer.
    pub write_timeout: Duration,
    /// Most open connections; further ones wait until others end.
    pub connections_max: usize,
    /// Largest body of a batch in bytes.
    pub batch_max_bytes: u64,
    /// Most cases of a batch.
    pub batch_max_cases: u32,
    /// Requests without a key are answered, as those of a tenant of their own.
    pub anonymous: bool,
    /// Requests per second of one key, or of one address without a key; 0 for any number.
    pub requests_per_second: u32,
}

impl Default for HttpOptions {
    fn default() -> Self {
        HttpOptions {
            body_max_bytes: 8 << 20,
            // Longer than the usual proxies keep an idle connection, so that they close it first.
            head_timeout: Duration::from_secs(75),
            body_timeout: Duration::from_secs(60),
            write_timeout: Duration::from_secs(60),
            // Files of the job table and of results need descriptors too; a process often has 1024.
            connections_max: 800,
            batch_max_bytes: 1 << 30,
            batch_max_cases: 200_000,
            anonymous: true,
            requests_per_second: 0,
        }
    }
}

/// What every handler can reach.
#[derive(Clone, FromRef)]
struct Shared {
    unscoped: Unscoped,
    access: Access,
    options: HttpOptions,
    metrics: metrics::Metrics,
}

/// The whole API, ready to be served.
pub fn router(jobs: Jobs, options: HttpOptions) -> Router {
    let (resources, _) = resources().split_for_parts();
    let metrics = metrics::Metrics::new(&jobs);
    let contract = SwaggerUi::new("/docs").config(
        // The validator badge would ask a server on the internet.
        Config::from("/openapi.json")
            .validator_url("none")
            .try_it_out_enabled(true),
    );
    let access = Access::new(&jobs, options);
    let router = resources
        .merge(contract)
        .route("/", get(|| async { Redirect::temporary("/docs/") }))
        .fallback(|uri: Uri| async move { error::unknown_route(uri.path()) })
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(options.body_max_bytes))
        .layer(RequestDecompressionLayer::new().gzip(true).zstd(true))
        .layer(from_fn_with_state(options, coding::limit_packed))
        .layer(CatchPanicLayer::custom(trace::answer_panic))
        .layer(from_fn(error::name_instance))
        .layer(coding::packing())
        .layer(from_fn(caching::complete))
        .layer(from_fn_with_state(metrics.clone(), metrics::count));
    let router = spans::trace(router, jobs.tracer())
        .layer(trace::span_layer())
        .layer(from_fn(trace::carry_request_id))
        .layer(from_fn(unread::read_away))
        .with_state(Shared {
            unscoped: Unscoped(jobs),
            access,
            options,
            metrics,
        });
    headers::secure(router)
}

/// Every documented route, in the order of the contract.
fn resources() -> OpenApiRouter<Shared> {
    let changing = OpenApiRouter::with_openapi(openapi::head())
        .routes(routes!(jobs::look, jobs::delete))
        .routes(routes!(batches::look, batches::delete))
        .routes(routes!(methods::methods))
        .route_layer(from_fn(caching::changing));
    let changing = openapi::conditional(changing);
    let finished = OpenApiRouter::new()
        .routes(routes!(jobs::case))
        .routes(routes!(results::result))
        .route_layer(from_fn(caching::finished));
    let finished = openapi::conditional(finished);
    let v1 = changing
        .merge(finished)
        .routes(routes!(jobs::submit, jobs::list))
        .routes(routes!(jobs::cancel))
        .routes(routes!(batches::submit))
        .routes(routes!(batches::cancel))
        .routes(routes!(cases::check))
        .routes(routes!(problems::list))
        .routes(routes!(problems::explain))
        .route_layer(from_fn(accept::require_json));
    // These choose among several forms themselves.
    let parts = OpenApiRouter::new()
        .routes(routes!(resultants::resultants))
        .routes(routes!(zones::zones))
        .routes(routes!(fields::tractions))
        .routes(routes!(fields::pressure))
        .routes(routes!(fields::slip))
        .routes(routes!(plot::svg))
        .routes(routes!(plot::png))
        .route_layer(from_fn(caching::finished));
    let parts = openapi::conditional(parts);
    let contract = OpenApiRouter::new()
        .routes(routes!(openapi::contract))
        .route_layer(from_fn(caching::changing));
    let contract = openapi::conditional(contract);
    v1.merge(parts)
        .routes(routes!(batch_results::results))
        .routes(routes!(events::job))
        .routes(routes!(events::batch))
        .routes(routes!(health::alive))
        .routes(routes!(health::ready))
        .routes(routes!(metrics::metrics))
        .merge(contract)
}

async fn method_not_allowed(method: axum::http::Method, uri: Uri) -> ApiError {
    ApiError::new(
        Kind::MethodNotAllowed,
        format!(
            "`{method}` is not possible on `{}`; the header `Allow` lists what is",
            uri.path()
        ),
    )
}
