//! What streams of server-sent events have in common: who may have one, how an event is written, and when the stream ends.

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::{FromRef, FromRequestParts};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::{Stream, StreamExt};
use serde::Serialize;

use crate::http::extract::accept::choose;
use crate::http::extract::caller::{Caller, Credential, revoked};
use crate::http::layers::auth::Access;
use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::{HeldPermits, hold_while_sent};
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::jobs::Jobs;

/// A comment is sent when nothing has happened for this long, so that no one in between closes the connection.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// When a client should connect again after the connection was lost.
const RETRY: Duration = Duration::from_secs(1);

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// A client that asks for a stream of events.
pub(crate) struct EventRequest {
    /// Its jobs.
    pub jobs: Jobs,
    /// The event that it saw last.
    pub seen: Option<String>,
    concurrency: ConcurrencyLimits,
    held: HeldPermits,
    key: Option<Credential>,
}

impl<S: Send + Sync> FromRequestParts<S> for EventRequest
where
    Access: FromRef<S>,
    ConcurrencyLimits: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let Caller(jobs) = Caller::from_request_parts(parts, state).await?;
        choose(&parts.headers, None, &[Format::Events])?;
        Ok(EventRequest {
            jobs,
            seen: last_event_id(&parts.headers),
            concurrency: ConcurrencyLimits::from_ref(state),
            held: parts.extensions.get().cloned().unwrap_or_default(),
            key: parts.extensions.get().cloned(),
        })
    }
}

impl EventRequest {
    /// The stream as an answer. It counts as a stream of the tenant, no longer as a request, and ends once the key was revoked.
    ///
    /// # Errors
    /// The tenant follows as much as it may already.
    pub(crate) fn answer(
        self,
        events: impl Stream<Item = Result<Event, Infallible>> + Send + 'static,
    ) -> Result<Response, ApiError> {
        let place = self.concurrency.stream(self.jobs.tenant())?;
        self.held.release();
        let events = events.take_until(revoked(self.jobs, self.key));
        let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE));
        Ok(hold_while_sent(events.into_response(), place))
    }
}

/// The change, if there is one; a failure ends the stream, and the client connects again.
pub(crate) fn changed<T>(change: Result<Option<T>, impl std::fmt::Display>) -> Option<T> {
    change
        .inspect_err(|reason| tracing::debug!(%reason, "a stream of events ended early"))
        .ok()
        .flatten()
}

/// An event of this name; `id` says what was seen with it.
pub(crate) fn event<T: Serialize>(name: &str, id: &str, data: &T) -> Option<Event> {
    let event = Event::default().event(name).id(id).retry(RETRY);
    event.json_data(data).ok()
}

fn last_event_id(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(LAST_EVENT_ID)?;
    value.to_str().ok().map(str::to_owned)
}
