//! Routes that are copied by reference. Each layer of [`from_fn`](axum::middleware::from_fn) copies all that is inside it for every request; behind this layer
//! there is one copy to be made, however deep it is.

use std::convert::Infallible;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::extract::Request;
use axum::response::Response;
use axum::routing::Route;
use tower::{Layer, Service};

/// Makes a route cheap to copy.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shared;

impl Layer<Route> for Shared {
    type Service = SharedRoute;

    fn layer(&self, route: Route) -> SharedRoute {
        SharedRoute(Arc::new(route))
    }
}

/// A route behind a reference.
#[derive(Debug, Clone)]
pub(crate) struct SharedRoute(Arc<Route>);

impl Service<Request> for SharedRoute {
    type Response = Response;
    type Error = Infallible;
    type Future = <Route as Service<Request>>::Future;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        // A route is always ready.
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: Request) -> Self::Future {
        Route::clone(&self.0).call(request)
    }
}
