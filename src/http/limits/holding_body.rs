//! A body that holds a resource until it has been sent, such as a share of memory.

use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::middleware::Next;
use axum::response::Response;
use hyper::body::{Frame, SizeHint};

use crate::http::limits::tenant_semaphore::Permit;
use crate::jobs::sync::lock;

/// A body and the resource that it holds.
struct HoldingBody<T>(Body, T);

/// The same answer; `held` is dropped when its body has been sent.
pub(crate) fn hold_while_sent<T: Send + Unpin + 'static>(response: Response, held: T) -> Response {
    response.map(|body| Body::new(HoldingBody(body, held)))
}

impl<T: Unpin> HttpBody for HoldingBody<T> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.0).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.0.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.0.size_hint()
    }
}

/// Permits that a request holds until its answer has been sent; in its extensions.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeldPermits(Arc<Mutex<Vec<Permit>>>);

impl HeldPermits {
    /// Holds one more share.
    pub(crate) fn add(&self, share: Permit) {
        lock(&self.0).push(share);
    }

    /// Gives all shares back; the caller counts the rest of the request elsewhere.
    pub(crate) fn release(&self) {
        lock(&self.0).clear();
    }
}

/// Layer in which requests can hold shares.
pub(crate) async fn hold(mut request: Request, next: Next) -> Response {
    let held = HeldPermits::default();
    request.extensions_mut().insert(held.clone());
    hold_while_sent(next.run(request).await, held)
}
