//! Accepts connections, not too many at once, lets go of clients that never finish a request's head or take nothing of
//! their answer, and ends when told to.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, Response};
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use tokio::net::TcpListener;
use tokio::time::sleep;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use crate::http::HttpOptions;
use crate::http::access::Peer;
use crate::http::carrying::carrying;
use crate::http::places::{Place, Places};
use crate::http::write_limit::WriteLimit;

/// Marks a request on a connection that came when all places were taken: only the probes are answered.
#[derive(Debug, Clone, Copy)]
pub struct ProbesOnly;

/// Serves a router until `stop`; then no connection is accepted any more, and this returns when the open requests have
/// been answered.
///
/// A connection whose first request head is not there within [`HttpOptions::first_head_timeout`], or the next one within
/// [`HttpOptions::head_timeout`], is closed, be it that a client sends a byte now and then or nothing at all; the time for
/// bodies is kept by those who read them. When [`HttpOptions::connections_max`] connections are open, or
/// [`HttpOptions::address_connections_max`] of one address, the one that has waited longest without a complete head is
/// closed for the new one.
pub async fn serve(
    mut listener: TcpListener,
    router: Router,
    options: HttpOptions,
    stop: CancellationToken,
) {
    let mut builder = Builder::new();
    builder
        .timer(TokioTimer::new())
        .header_read_timeout(options.head_timeout);
    let open = GracefulShutdown::new();
    let places = Places::new(options.connections_max, options.address_connections_max);
    loop {
        let accepted = async {
            places.room().await;
            // Errors of single connections are passed over, a lack of descriptors is waited out.
            Listener::accept(&mut listener).await
        };
        let (stream, address) = tokio::select! {
            () = stop.cancelled() => break,
            accepted = accepted => accepted,
        };
        // Events and lines are small and wanted as they come.
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "a connection sends in large pieces only");
        }
        let place = places.enter(address.ip());
        let stream = WriteLimit::new(stream, options.write_timeout);
        let (router, peer, own) = (router.clone(), Peer(address.ip()), place.clone());
        let service = service_fn(move |request: Request<Incoming>| {
            let (router, place) = (router.clone(), own.clone());
            async move { Ok::<_, std::convert::Infallible>(answer(router, peer, &place, request).await) }
        });
        let connection = builder.serve_connection(TokioIo::new(stream), service);
        let connection = open.watch(connection);
        tokio::spawn(async move {
            tokio::select! {
                ended = connection => if let Err(error) = ended {
                    tracing::debug!(%error, "connection ended early");
                },
                () = place.closed() => tracing::debug!("connection closed for a new one"),
                () = silent(&place, options.first_head_timeout) => {}
            }
        });
    }
    drop(listener);
    open.shutdown().await;
}

/// Answers one request; its connection counts as busy until the answer has been handed over.
async fn answer(
    router: Router,
    peer: Peer,
    place: &Arc<Place>,
    request: Request<Incoming>,
) -> Response<Body> {
    let busy = place.begin();
    let mut request = request.map(Body::new);
    request.extensions_mut().insert(peer);
    if place.probes_only {
        request.extensions_mut().insert(ProbesOnly);
    }
    let Ok(response) = router.oneshot(request).await;
    carrying(response, busy)
}

/// Ends if there is no complete head within this time.
async fn silent(place: &Place, within: Duration) {
    sleep(within).await;
    if place.is_used() {
        std::future::pending::<()>().await;
    }
}
