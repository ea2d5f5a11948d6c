//! One connection: its peer, its requests, and how long it may stay silent.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, Response, Version};
use hyper::body::Incoming;
use tokio::time::sleep;
use tower::ServiceExt;

use crate::http::limits::holding_body::hold_while_sent;
use crate::http::server::places::Place;
use crate::http::server::unread::Unread;

/// The address that a request comes from, its client's if a trusted proxy passes it on; in its extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peer(pub IpAddr);

/// Marks a request on a connection that came when all places were taken: only the probes are answered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProbesOnly;

/// Answers one request; its connection counts as busy until the answer has been handed over.
pub(crate) async fn answer(
    router: Router,
    peer: Peer,
    place: &Arc<Place>,
    unread: &Unread,
    request: Request<Incoming>,
) -> Response<Body> {
    let busy = place.begin();
    let mut request = request.map(Body::new);
    request.extensions_mut().insert(peer);
    if place.probes_only {
        request.extensions_mut().insert(ProbesOnly);
    }
    let several_at_once = request.version() == Version::HTTP_2;
    let Ok(response) = router.oneshot(request).await;
    let response = hold_while_sent(response, busy);
    if several_at_once {
        unread.watch(response)
    } else {
        response
    }
}

/// Ends if there is no complete head within this time.
pub(crate) async fn silent(place: &Place, within: Duration) {
    sleep(within).await;
    if place.is_used() {
        std::future::pending::<()>().await;
    }
}
