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
mod carrying;
mod cases;
mod cells;
mod coding;
mod connections;
mod crowds;
pub mod elements;
mod error;
mod events;
mod fields;
mod formats;
mod guard;
mod headers;
mod health;
mod job;
mod jobs;
mod json_weight;
mod memory;
mod methods;
mod metrics;
mod openapi;
mod options;
mod picture;
mod places;
mod plot;
mod problem;
mod problems;
mod process;
mod query;
mod remarks;
mod resultants;
mod results;
mod shares;
mod spans;
pub mod table_body;
mod trace;
mod unread;
mod wishes;
mod write_limit;
mod zones;

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
use crate::http::crowds::Crowds;
use crate::http::error::{ApiError, Kind};
use crate::http::memory::Memory;
use crate::http::metrics::Metrics;
use crate::jobs::Jobs;

pub use crate::http::access::Peer;
pub use crate::http::connections::serve;
pub use crate::http::headers::allow_origins;
pub use crate::http::openapi::openapi_json;
pub use crate::http::options::HttpOptions;

/// What every handler can reach.
#[derive(Clone, FromRef)]
struct Shared {
    unscoped: Unscoped,
    access: Access,
    options: HttpOptions,
    crowds: Crowds,
    memory: Memory,
    metrics: Metrics,
}

/// The whole API, ready to be served.
pub fn router(jobs: Jobs, options: HttpOptions) -> Router {
    let metrics = Metrics::new(&jobs, || 0);
    api(jobs, options, metrics)
}

/// The whole API, and the probes and metrics alone for a port of their own, on which requests without a key are answered
/// if `probes_anonymous` says so. `dropped_lines` says how many lines of the log nobody read.
pub fn routers(
    jobs: Jobs,
    options: HttpOptions,
    probes_anonymous: bool,
    dropped_lines: fn() -> u64,
) -> [Router; 2] {
    let metrics = Metrics::new(&jobs, dropped_lines);
    let mut alone = options.clone();
    alone.anonymous = probes_anonymous;
    let (probes, _) = probes().split_for_parts();
    let probes = probes
        .fallback(|uri: Uri| async move { error::unknown_route(uri.path()) })
        .layer(from_fn(error::name_instance))
        .with_state(Shared::new(jobs.clone(), alone, metrics.clone()));
    [api(jobs, options, metrics), headers::secure(probes)]
}

fn api(jobs: Jobs, options: HttpOptions, metrics: Metrics) -> Router {
    let (resources, _) = resources().split_for_parts();
    let contract = SwaggerUi::new("/docs").config(
        // The validator badge would ask a server on the internet.
        Config::from("/openapi.json")
            .validator_url("none")
            .try_it_out_enabled(true),
    );
    let router = resources
        .merge(contract)
        .route("/", get(|| async { Redirect::temporary("/docs/") }))
        .fallback(|uri: Uri| async move { error::unknown_route(uri.path()) })
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(options.body_max_bytes))
        .layer(RequestDecompressionLayer::new().gzip(true).zstd(true))
        .layer(from_fn_with_state(options.clone(), coding::limit_packed))
        .layer(CatchPanicLayer::custom(trace::answer_panic))
        .layer(from_fn(carrying::hold))
        .layer(from_fn(guard::admit))
        .layer(from_fn(error::name_instance))
        .layer(coding::packing())
        .layer(from_fn(caching::complete))
        .layer(from_fn_with_state(metrics.clone(), metrics::count));
    let router = spans::trace(router, jobs.tracer())
        .layer(trace::span_layer())
        .layer(from_fn(trace::carry_request_id))
        .layer(from_fn(unread::read_away))
        .with_state(Shared::new(jobs, options, metrics));
    headers::secure(router)
}

impl Shared {
    fn new(jobs: Jobs, options: HttpOptions, metrics: Metrics) -> Shared {
        Shared {
            access: Access::new(&jobs, &options),
            crowds: Crowds::new(&options),
            memory: Memory::new(&options),
            unscoped: Unscoped(jobs),
            options,
            metrics,
        }
    }
}

/// Every documented route, in the order of the contract.
fn resources() -> OpenApiRouter<Shared> {
    let changing = OpenApiRouter::with_openapi(openapi::head())
        .routes(routes!(jobs::look, jobs::delete))
        .routes(routes!(batches::look, batches::delete))
        .routes(routes!(methods::methods))
        .routes(routes!(remarks::remarks))
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
        .merge(probes())
        .merge(contract)
}

/// What is asked every few seconds, of a port of its own if there is one.
fn probes() -> OpenApiRouter<Shared> {
    OpenApiRouter::new()
        .routes(routes!(health::alive))
        .routes(routes!(health::ready))
        .routes(routes!(metrics::metrics))
}

async fn method_not_allowed(method: axum::http::Method, uri: Uri) -> ApiError {
    let hint = match method {
        axum::http::Method::OPTIONS => "; web pages of other origins need `--cors-origin`",
        _ => "",
    };
    ApiError::new(
        Kind::MethodNotAllowed,
        format!(
            "`{method}` is not possible on `{}`; the header `Allow` lists what is{hint}",
            uri.path()
        ),
    )
}
