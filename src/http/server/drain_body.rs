//! Reads the rest of a body whose request has been answered already.
//!
//! A faulty batch is refused at its first fault, while the rest of it is on the way. The connection cannot be used again
//! before that rest has been read, and closing it at once can lose the answer: the client fails while it writes, and never reads.
//! So a short rest is read before the answer is sent. If more follows, the answer says that the connection closes, and more of the
//! rest is read and discarded meanwhile.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
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

/// Longest rest that is read before the answer is sent, in bytes.
const REST_BYTES: usize = 1 << 20;
/// How long the client may take to send it.
const REST_WITHIN: Duration = Duration::from_millis(500);

/// Longest rest that is read after that, in bytes: as much as the largest body that is held in memory by default.
const LATE_BYTES: usize = 64 << 20;
/// How long the client may take to send it. Chosen by judgement: a client that writes without reading needs 6 MB/s for all of it.
const LATE_WITHIN: Duration = Duration::from_secs(10);

type BodySlot = Arc<Mutex<Option<Body>>>;

/// Layer that discards the rest of a body, or has the connection closed; it stands around everything that reads bodies.
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
    let rest = slot.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(mut rest) = rest
        && (asks || timeout(REST_WITHIN, ends(&mut rest, REST_BYTES)).await != Ok(true))
    {
        let close = HeaderValue::from_static("close");
        response.headers_mut().insert(header::CONNECTION, close);
        if !asks {
            // The connection stays open until this ends, so that the client can send on and then read its answer.
            tokio::spawn(timeout(LATE_WITHIN, async move {
                ends(&mut rest, LATE_BYTES).await
            }));
        }
    }
    response
}

/// Reads a body to its end; `false` if it breaks or is longer than allowed.
async fn ends(body: &mut Body, most: usize) -> bool {
    let mut body = Limited::new(body, most);
    while let Some(frame) = body.frame().await {
        if frame.is_err() {
            return false;
        }
    }
    true
}

/// A body that goes into the slot if it is dropped before its end.
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
            let mut slot = self.1.lock().unwrap_or_else(PoisonError::into_inner);
            *slot = Some(body);
        }
    }
}
