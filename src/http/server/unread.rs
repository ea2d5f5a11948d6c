//! Closes HTTP/2 connections with an answer that the client does not take.
//!
//! On HTTP/2 each answer waits for a window that its client grants, so the connection itself never stands still and
//! `WriteTimeout` sees nothing. An answer counts as not taken from the moment when a piece of it was handed over until
//! the next piece is asked for. Pieces are small, because whatever has been handed over is held outside every count of memory.

use std::collections::HashMap;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::body::{Body, Bytes, HttpBody};
use axum::http::Response;
use hyper::body::{Frame, SizeHint};
use tokio::time::{Instant, sleep};

/// Largest piece of an answer that is handed over at once, in bytes.
pub(crate) const PIECE_BYTES: usize = 16 << 10;

/// The answers of one connection that wait for their client; clones share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unread(Arc<Mutex<Waiting>>);

#[derive(Debug, Default)]
struct Waiting {
    next: u64,
    since: HashMap<u64, Instant>,
}

impl Unread {
    /// The same answer, in small pieces and watched.
    pub(crate) fn watch(&self, response: Response<Body>) -> Response<Body> {
        let id = {
            let mut waiting = self.waiting();
            waiting.next += 1;
            waiting.next
        };
        response.map(|body| {
            let watched = WatchedBody {
                body,
                rest: Bytes::new(),
                id,
                unread: self.clone(),
            };
            watched.handed_over();
            Body::new(watched)
        })
    }

    /// Ends when an answer has waited for its client this long.
    pub(crate) async fn stalled(&self, limit: Duration) {
        loop {
            let oldest = self.waiting().since.values().min().copied();
            let left = oldest.map_or(limit, |since| limit.saturating_sub(since.elapsed()));
            if left.is_zero() {
                return;
            }
            sleep(left).await;
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct WatchedBody {
    body: Body,
    /// What of a large piece has not been handed over yet.
    rest: Bytes,
    id: u64,
    unread: Unread,
}

impl WatchedBody {
    fn handed_over(&self) {
        let mut waiting = self.unread.waiting();
        waiting.since.insert(self.id, Instant::now());
    }

    fn asked_for(&self) {
        self.unread.waiting().since.remove(&self.id);
    }
}

impl HttpBody for WatchedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        self.asked_for();
        if self.rest.is_empty() {
            let next = ready!(Pin::new(&mut self.body).poll_frame(context));
            let Some(Ok(frame)) = next else {
                return Poll::Ready(next);
            };
            match frame.into_data() {
                Ok(data) => self.rest = data,
                Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
            }
        }
        let length = self.rest.len().min(PIECE_BYTES);
        let piece = self.rest.split_to(length);
        self.handed_over();
        Poll::Ready(Some(Ok(Frame::data(piece))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        let rest = self.rest.len() as u64;
        let body = self.body.size_hint();
        let mut hint = SizeHint::new();
        hint.set_lower(body.lower() + rest);
        if let Some(upper) = body.upper() {
            hint.set_upper(upper + rest);
        }
        hint
    }
}

impl Drop for WatchedBody {
    fn drop(&mut self) {
        self.asked_for();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use http_body_util::BodyExt;

    #[tokio::test]
    async fn answers_count_as_unread_from_a_piece_handed_over_to_the_next_one_asked_for() {
        let unread = Unread::default();
        let waiting = || unread.waiting().since.len();
        let data = vec![7; 3 * PIECE_BYTES + 1];
        let mut body = unread
            .watch(Response::new(Body::from(data.clone())))
            .into_body();
        assert_eq!(
            (waiting(), body.size_hint().exact()),
            (1, Some(data.len() as u64))
        );
        let mut read = Vec::new();
        while let Some(frame) = body.frame().await {
            let piece = frame.unwrap().into_data().unwrap();
            assert!(piece.len() <= PIECE_BYTES);
            read.extend(piece);
            assert_eq!(waiting(), 1);
        }
        assert_eq!((read, waiting()), (data.clone(), 0));
        let mut body = unread.watch(Response::new(Body::from(data))).into_body();
        let _ = body.frame().await;
        // Ends by itself.
        unread.stalled(Duration::from_millis(20)).await;
        drop(body);
        assert_eq!(waiting(), 0);
    }

    #[tokio::test]
    async fn an_answer_that_has_nothing_to_say_yet_is_not_unread() {
        let unread = Unread::default();
        let silent =
            Body::from_stream(futures_util::stream::pending::<Result<Bytes, axum::Error>>());
        let mut body = unread.watch(Response::new(silent)).into_body();
        assert!(futures_util::poll!(Box::pin(body.frame())).is_pending());
        assert!(unread.waiting().since.is_empty());
    }
}
