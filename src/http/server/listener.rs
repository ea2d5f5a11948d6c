//! Accepts connections up to a limit, closes those whose client does not finish the head of a request or does not read its
//! answer, and stops on request.

use std::time::Duration;

use axum::Router;
use axum::http::Request;
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::server::graceful::GracefulShutdown;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

use crate::http::options::HttpOptions;
use crate::http::server::connection::{Peer, answer, silent};
use crate::http::server::places::Places;
use crate::http::server::unread::{PIECE_BYTES, Unread};
use crate::http::server::write_timeout::WriteTimeout;

/// Requests of one HTTP/2 connection at a time; more of them wait at the client. Clients send as many before they are told
/// (RFC 9113, section 6.5.2, advises no less).
const STREAMS_MAX: u32 = 100;
/// How long the peer of an HTTP/2 connection may leave a ping unanswered. A choice, as long as hyper's own.
const PING_WITHIN: Duration = Duration::from_secs(20);

/// Serves a router until `stop`; then no connection is accepted any more, and this returns when the open requests have
/// been answered.
///
/// A connection whose first request head is not there within [`HttpOptions::first_head_timeout`], or the next one within
/// [`HttpOptions::head_timeout`], is closed, be it that a client sends a byte now and then or nothing at all; the time for
/// bodies is kept by those who read them. When [`HttpOptions::connections_max`] connections are open, or
/// [`HttpOptions::address_connections_max`] of one address, the one that has waited longest without a complete head is
/// closed for the new one.
///
/// HTTP/1.1 and HTTP/2 are understood, the latter by prior knowledge (RFC 9113, section 3.3), as proxies use it. An HTTP/2
/// connection without a request stays open as long as its peer answers pings and its place is not needed.
pub async fn serve(
    mut listener: TcpListener,
    router: Router,
    options: HttpOptions,
    stop: CancellationToken,
) {
    let builder = protocols(&options);
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
        // A trusted proxy connects for many clients.
        let mut proxies = options.trusted_proxies.iter();
        let proxy = proxies.any(|range| range.contains(address.ip()));
        let place = places.enter(address.ip(), !proxy);
        let stream = WriteTimeout::new(stream, options.write_timeout);
        let left = stream.client_left();
        let unread = Unread::default();
        let (router, peer, own) = (router.clone(), Peer(address.ip()), place.clone());
        let watch = unread.clone();
        let service = service_fn(move |request: Request<Incoming>| {
            let (router, place, unread) = (router.clone(), own.clone(), watch.clone());
            async move {
                let response = answer(router, peer, &place, &unread, request).await;
                Ok::<_, std::convert::Infallible>(response)
            }
        });
        let connection = builder.serve_connection(TokioIo::new(stream), service);
        let connection = open.watch(connection.into_owned());
        tokio::spawn(async move {
            tokio::select! {
                ended = connection => if let Err(error) = ended {
                    tracing::debug!(%error, "connection ended early");
                },
                () = place.closed() => tracing::debug!("connection closed for a new one"),
                () = silent(&place, options.first_head_timeout) => {}
                () = left => tracing::debug!("connection closed: its client has left"),
                () = unread.stalled(options.write_timeout) => {
                    tracing::debug!("connection closed: its client does not take an answer");
                }
            }
        });
    }
    drop(listener);
    open.shutdown().await;
}

/// How connections are read and written.
fn protocols(options: &HttpOptions) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(options.head_timeout);
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(STREAMS_MAX)
        .max_send_buf_size(PIECE_BYTES)
        .keep_alive_interval(options.head_timeout)
        .keep_alive_timeout(PING_WITHIN);
    builder
}
