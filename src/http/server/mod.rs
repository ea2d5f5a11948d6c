//! The accept loop: limits of connections, and graceful shutdown.

pub(super) mod connections;
pub(super) mod drain_body;

use std::convert::Infallible;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

use crate::options::HttpOptions;
use crate::server::connections::{Connection, Connections, Peer, ProbesOnly};

/// Concurrent requests of one HTTP/2 connection; RFC 9113, section 6.5.2, advises at least 100.
const STREAMS_MAX: u32 = 100;
/// Time in which the peer of an HTTP/2 connection must answer a ping; hyper's default.
const PING_WITHIN: Duration = Duration::from_secs(20);
/// Interval between two searches for overdue connections.
const SWEEP: Duration = Duration::from_millis(100);
/// Time for announcing the end of a connection to its peer.
const GOODBYE: Duration = Duration::from_secs(1);

/// Serves a router until `stop` is cancelled. Then it accepts no more connections, and returns when all active requests are answered.
///
/// [`Connections`] states which connections are closed early. The readers of bodies enforce their own timeouts. HTTP/2 is
/// accepted by prior knowledge (RFC 9113, section 3.3), as proxies use it.
pub async fn serve(
    mut listener: TcpListener,
    router: Router,
    options: HttpOptions,
    stop: CancellationToken,
) {
    let builder = protocols(&options);
    let connections = Arc::new(Connections::new(&options));
    let tasks = TaskTracker::new();
    let mut sweep = interval(SWEEP);
    sweep.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let (stream, address) = tokio::select! {
            () = stop.cancelled() => break,
            _ = sweep.tick() => {
                connections.close_overdue();
                continue;
            }
            // `accept` retries failures of single connections, and pauses while there are no free descriptors.
            accepted = Listener::accept(&mut listener) => accepted,
        };
        // Events and lines are small and must be sent without delay.
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "TCP_NODELAY could not be set");
        }
        // A trusted proxy connects on behalf of many clients.
        let mut proxies = options.trusted_proxies.iter();
        let proxy = proxies.any(|range| range.contains(address.ip()));
        let peer = Peer(address.ip());
        if let Some(connection) = connections.open(address.ip(), !proxy) {
            let (builder, router, stop) = (builder.clone(), router.clone(), stop.clone());
            tasks.spawn(answer(builder, stream, peer, router, connection, stop));
        }
    }
    drop(listener);
    tasks.close();
    loop {
        tokio::select! {
            () = tasks.wait() => return,
            _ = sweep.tick() => connections.close_overdue(),
        }
    }
}

fn protocols(options: &HttpOptions) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    // `Connections` limits the time for heads, even before the version of HTTP is known.
    builder.http1().header_read_timeout(None);
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(STREAMS_MAX)
        .max_send_buf_size(connections::PIECE_BYTES)
        .keep_alive_interval(options.head_timeout)
        .keep_alive_timeout(PING_WITHIN);
    builder
}

/// Answers the requests of a connection until it ends or must be closed.
async fn answer(
    builder: Builder<TokioExecutor>,
    stream: TcpStream,
    peer: Peer,
    router: Router,
    connection: Connection,
    stop: CancellationToken,
) {
    let service = service_fn(|request: Request<Incoming>| {
        let active = connection.begin_request();
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(peer);
        if connection.probes_only() {
            request.extensions_mut().insert(ProbesOnly);
        }
        let response = router.clone().oneshot(request);
        async move {
            let Ok(response) = response.await;
            Ok::<_, Infallible>(response.map(|body| active.send(body)))
        }
    });
    let mut served = pin!(builder.serve_connection(TokioIo::new(stream), service));
    let ended = tokio::select! {
        ended = served.as_mut() => Some(ended),
        () = connection.closed() => None,
        () = stop.cancelled() => {
            served.as_mut().graceful_shutdown();
            tokio::select! {
                ended = served.as_mut() => Some(ended),
                () = connection.closed() => None,
            }
        }
    };
    match ended {
        Some(Ok(())) => {}
        Some(Err(error)) => tracing::debug!(%error, "connection ended early"),
        None => {
            tracing::debug!("connection closed: overdue, or replaced by a new one");
            served.as_mut().graceful_shutdown();
            let _ = timeout(GOODBYE, served).await;
        }
    }
}
