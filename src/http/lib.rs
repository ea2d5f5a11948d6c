//! The HTTP API of the service.
//!
//! A request takes these steps:
//!
//! 1. [`server::serve`] accepts the connection. [`server::connections`] limits the number of connections, and closes those whose client
//!    sends no request or does not read its response.
//! 2. The [`layers`] around all routes, from the outside inward: headers for browsers ([`response::secure`]), the client behind a trusted
//!    proxy ([`client_address`]), [`drain_body`], the request's id and its line in the log ([`request_log`]), `otel` (feature `otlp`),
//!    [`metrics`], [`etag::complete`], compression and the final line break ([`response`]), the path in problems
//!    ([`problem::name_instance`]), [`auth::admit`], the rate limit ([`auth::add_rate_limit_headers`]), the permits of the request
//!    ([`limits::hold`]), panics, [`admission`] and decompression of compressed bodies.
//! 3. The layers of a group of routes: content negotiation ([`accept::require_json`]) and caching ([`etag::immutable`],
//!    [`etag::revalidate`]).
//! 4. [`extract`] reads the caller (key, tenant, rate), ids, query and body strictly, within the [`limits`].
//! 5. The handler in [`routes`](mod@routes) calls [`Jobs`]. Parts of a result get their tag before any work is done ([`etag::tag_of`]).
//! 6. The response is a type of [`dto`] as JSON, or a format of [`render`].
//! 7. Every failure becomes a [`problem`] with a kind, a status and advice.
//!
//! [`page`] answers `/` and the files of the page, which needs no key and uses the same API.

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

mod contract;
mod dto;
pub mod extract;
mod layers;
mod limits;
mod options;
mod page;
mod problem;
mod render;
mod routes;
mod server;
mod state;

use std::sync::LazyLock;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::Uri;
use axum::middleware::{from_fn, from_fn_with_state};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::decompression::DecompressionLayer;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;
use utoipa_swagger_ui::{Config, SwaggerUi};

use crate::extract::caller::KINDS;
use crate::extract::{accept, query};
use crate::layers::metrics::{self, Metrics};
use crate::layers::{admission, auth, client_address, etag, request_log, response};
use crate::problem::{ApiError, ProblemKind};
use crate::routes::{
    batches, cases, evaluate, evolutions, fields, jobs, lists, plots, profiles, results, runs,
    service, work,
};
use crate::server::drain_body;
use crate::state::{AppState, Document};
use railhead_jobs::Jobs;
use railhead_jobs::model::Kind;

#[cfg(feature = "otlp")]
use crate::layers::otel;

pub use crate::layers::response::allow_origins;
pub use crate::options::{AddressRange, HttpOptions};
pub use crate::server::connections::Peer;
pub use crate::server::serve;

/// Returns the contract as JSON text that ends with a line break, the same as `api/openapi.json`.
#[must_use]
pub fn openapi_json() -> String {
    (DOCUMENT.0)().to_owned()
}

const DOCUMENT: Document = Document(|| {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let (_, document) = resources().split_for_parts();
        contract::text(document)
    });
    &TEXT
});

/// Returns the router of the API.
pub fn router(jobs: Jobs, options: HttpOptions) -> Router {
    let metrics = Metrics::new(&jobs, || 0);
    api(jobs, options, metrics)
}

/// Returns the router of the API, and one with the probes and metrics alone for a port of their own, which answers requests without a key
/// if `probes_anonymous` is set. `dropped_lines` returns the number of log lines that were dropped.
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
        .fallback(|uri: Uri| async move { problem::unknown_route(uri.path()) })
        .layer(from_fn(problem::name_instance))
        .with_state(AppState::new(
            jobs.clone(),
            alone,
            metrics.clone(),
            DOCUMENT,
        ));
    [api(jobs, options, metrics), response::secure(probes)]
}

fn api(jobs: Jobs, options: HttpOptions, metrics: Metrics) -> Router {
    let (resources, _) = resources().split_for_parts();
    let contract: Router<AppState> = SwaggerUi::new("/docs")
        .config(
            // The validator badge would call a server on the internet.
            Config::from("/openapi.json")
                .validator_url("none")
                .try_it_out_enabled(true),
        )
        .into();
    // The program contains its files compressed; clients choose the compression as for all responses.
    let contract = contract.layer(DecompressionLayer::new());
    let router = resources
        .merge(contract)
        .merge(page::routes(options.page_dir.clone()))
        .fallback(|uri: Uri| async move { problem::unknown_route(uri.path()) })
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(options.body_max_bytes))
        .layer(from_fn_with_state(options.clone(), admission::unpack))
        .layer(CatchPanicLayer::custom(response::answer_panic))
        .layer(from_fn(limits::hold))
        .layer(from_fn({
            let per_second = options.requests_per_second;
            move |request, next| auth::add_rate_limit_headers(per_second, request, next)
        }))
        .layer(from_fn(auth::admit))
        .layer(from_fn(problem::name_instance))
        .layer(from_fn(response::end_line))
        .layer(response::compression_layer())
        .layer(from_fn(etag::complete))
        .layer(from_fn_with_state(metrics.clone(), metrics::count));
    #[cfg(feature = "otlp")]
    let router = otel::trace(router, jobs.tracer());
    let router = router
        .layer(request_log::span_layer())
        .layer(from_fn(request_log::carry_request_id))
        .layer(from_fn(drain_body::drain_body))
        .layer(from_fn_with_state(options.clone(), client_address::resolve))
        .with_state(AppState::new(jobs, options, metrics, DOCUMENT));
    response::secure(router)
}

/// Returns every documented route, in the order of the contract.
fn resources() -> OpenApiRouter<AppState> {
    let every = |routes: fn(Kind) -> OpenApiRouter<AppState>| {
        let routes = KINDS.map(routes).into_iter();
        routes.fold(OpenApiRouter::new(), OpenApiRouter::merge)
    };
    let changing = OpenApiRouter::with_openapi(contract::head())
        .routes(routes!(service::methods))
        .routes(routes!(service::remarks))
        .routes(routes!(service::examples))
        .route_layer(from_fn(query::refuse_parameters));
    let one = every(work::one).route_layer(from_fn(query::refuse_all_but_wait));
    let changing = changing.merge(one).route_layer(from_fn(etag::revalidate));
    let changing = contract::conditional(changing);
    let case = OpenApiRouter::new()
        .routes(routes!(jobs::case))
        .routes(routes!(evolutions::request))
        .routes(routes!(evolutions::result))
        .route_layer(from_fn(query::refuse_parameters));
    let finished = OpenApiRouter::new()
        .routes(routes!(results::result))
        .route_layer(from_fn(query::refuse_all_but_wait))
        .merge(case)
        .route_layer(from_fn(etag::immutable));
    let finished = contract::conditional(finished);
    // These handlers check their parameters themselves.
    let lists = OpenApiRouter::new()
        .routes(routes!(jobs::submit))
        .routes(routes!(batches::submit))
        .routes(routes!(evolutions::submit))
        .routes(routes!(runs::submit))
        .merge(every(lists::list))
        .route_layer(from_fn(etag::revalidate));
    let lists = contract::conditional(lists);
    let plain = every(work::cancel)
        .routes(routes!(profiles::keep))
        .routes(routes!(profiles::get, profiles::delete))
        .routes(routes!(runs::manifest))
        .routes(routes!(runs::row))
        .routes(routes!(cases::check))
        .routes(routes!(service::list_problems))
        .routes(routes!(service::explain))
        .route_layer(from_fn(query::refuse_parameters));
    let v1 = changing
        .merge(finished)
        .merge(plain)
        .routes(routes!(service::me))
        .routes(routes!(profiles::list))
        .routes(routes!(runs::totals))
        .merge(lists)
        .route_layer(from_fn(accept::require_json));
    // These handlers negotiate their formats themselves.
    let parts = OpenApiRouter::new()
        .routes(routes!(results::resultants))
        .routes(routes!(fields::zones))
        .routes(routes!(fields::fields))
        .routes(routes!(fields::tractions))
        .routes(routes!(fields::pressure))
        .routes(routes!(fields::slip))
        .routes(routes!(fields::temperature))
        .routes(routes!(results::subsurface))
        .routes(routes!(results::damage))
        .routes(routes!(plots::svg))
        .routes(routes!(plots::png))
        .routes(routes!(evolutions::table))
        .routes(routes!(evolutions::section))
        .route_layer(from_fn(etag::immutable));
    let parts = contract::conditional(parts);
    let contract = OpenApiRouter::new()
        .routes(routes!(contract::contract))
        .route_layer(from_fn(etag::revalidate));
    let contract = contract::conditional(contract);
    let events = every(work::events)
        .routes(routes!(work::follow_all))
        .route_layer(from_fn(query::refuse_parameters));
    v1.merge(parts)
        .routes(routes!(runs::results))
        .routes(routes!(batches::results))
        .routes(routes!(evaluate::evaluate))
        .merge(events)
        .merge(probes())
        .merge(contract)
}

/// Returns the routes that monitoring requests every few seconds, possibly on a port of their own.
fn probes() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(service::alive))
        .routes(routes!(service::ready))
        .routes(routes!(service::metrics))
}

async fn method_not_allowed(method: axum::http::Method, uri: Uri) -> ApiError {
    let hint = match method {
        axum::http::Method::OPTIONS => "; web pages of other origins need `--cors-origin`",
        _ => "",
    };
    ApiError::new(
        ProblemKind::MethodNotAllowed,
        format!(
            "`{method}` is not supported on `{}`; the header `Allow` lists the supported methods{hint}",
            uri.path()
        ),
    )
}
