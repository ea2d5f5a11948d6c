//! Reads the rest of a body whose request has already been answered.
//!
//! A request may be refused while its body is still arriving. If the connection closed at once, the client would fail to write and never
//! read the response. The rest is therefore read and discarded. After a long rest the connection closes, as the response announces.

use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::Response;
use http_body_util::{BodyExt, Limited};
use hyper::body::{Frame, SizeHint};
use tokio::time::timeout;

use railhead_jobs::sync::lock;

/// Longest rest in bytes after which the connection stays open.
const SHORT_BYTES: u64 = 1 << 20;
/// Longest rest that is read, in bytes: the largest body that is held in memory by default.
const REST_BYTES: usize = 64 << 20;
/// Time for the client to send the rest.
const REST_WITHIN: Duration = Duration::from_secs(10);

type BodySlot = Arc<Mutex<Option<Body>>>;

/// Layer around all readers of bodies that discards the rest of a body.
pub(crate) async fn drain_body(request: Request, next: Next) -> Response {
    if request.body().is_end_stream() {
        return next.run(request).await;
    }
    // With `Expect: 100-continue` the client has not begun to send, and reading would ask it to.
    let asks = request.headers().contains_key(header::EXPECT);
    let slot = BodySlot::default();
    let kept = slot.clone();
    let request = request.map(|body| Body::new(DrainableBody(Some(body), kept)));
    let mut response = next.run(request).await;
    let rest = lock(&slot).take();
    if let Some(rest) = rest {
        if asks || rest.size_hint().lower() > SHORT_BYTES {
            let close = HeaderValue::from_static("close");
            response.headers_mut().insert(header::CONNECTION, close);
        }
        if !asks {
            let mut rest = Limited::new(rest, REST_BYTES);
            // The connection stays open until this ends, so that the client can finish sending and then read the response.
            tokio::spawn(timeout(REST_WITHIN, async move {
                while let Some(Ok(_)) = rest.frame().await {}
            }));
        }
    }
    response
}

/// A body that moves into the slot if it is dropped before its end.
struct DrainableBody(Option<Body>, BodySlot);

impl HttpBody for DrainableBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let Some(body) = &mut self.0 else {
            return Poll::Ready(None);
        };
        let frame = ready!(Pin::new(body).poll_frame(context));
        if !matches!(frame, Some(Ok(_))) {
            self.0 = None;
        }
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.0.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        let none = || SizeHint::with_exact(0);
        self.0.as_ref().map_or_else(none, HttpBody::size_hint)
    }
}

impl Drop for DrainableBody {
    fn drop(&mut self) {
        if let Some(body) = self.0.take().filter(|body| !body.is_end_stream()) {
            let mut slot = lock(&self.1);
            *slot = Some(body);
        }
    }
}
