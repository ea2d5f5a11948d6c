//! Accepts connections up to a limit, closes those whose client does not finish the head of a request or does not read its
//! answer, and stops on request.

use axum::Router;
use axum::http::Request;
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

use crate::http::options::HttpOptions;
use crate::http::server::connection::{Peer, answer, silent};
use crate::http::server::places::Places;
use crate::http::server::write_timeout::WriteTimeout;

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
        let stream = WriteTimeout::new(stream, options.write_timeout);
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
