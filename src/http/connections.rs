//! Accepts connections, not too many at once, lets go of clients that never finish a request's head or take nothing of
//! their answer, and ends when told to.

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use crate::http::HttpOptions;
use crate::http::access::Peer;
use crate::http::write_limit::WriteLimit;

/// Serves a router until `stop`; then no connection is accepted any more, and this returns when the open requests have
/// been answered.
///
/// A connection whose next request head is not there within [`HttpOptions::head_timeout`] is closed, be it that a
/// client sends a byte now and then or nothing at all; the time for bodies is kept by those who read them. Of more than
/// [`HttpOptions::connections_max`] connections the last ones wait to be accepted: without descriptors to spare the
/// service could not even store a result.
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
    let places = Arc::new(Semaphore::new(options.connections_max));
    loop {
        let accepted = async {
            let place = places.clone().acquire_owned().await;
            // Errors of single connections are passed over, a lack of descriptors is waited out.
            (Listener::accept(&mut listener).await, place)
        };
        let ((stream, address), place) = tokio::select! {
            () = stop.cancelled() => break,
            accepted = accepted => accepted,
        };
        let stream = WriteLimit::new(stream, options.write_timeout);
        let peer = Peer(address.ip());
        let service = router
            .clone()
            .map_request(move |mut request: Request<Incoming>| {
                request.extensions_mut().insert(peer);
                request.map(Body::new)
            });
        let service = TowerToHyperService::new(service);
        let connection = builder.serve_connection(TokioIo::new(stream), service);
        let connection = open.watch(connection);
        tokio::spawn(async move {
            if let Err(error) = connection.await {
                tracing::debug!(%error, "connection ended early");
            }
            drop(place);
        });
    }
    drop(listener);
    open.shutdown().await;
}
