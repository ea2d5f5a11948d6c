//! How requests wait and follow: `Prefer: wait=N`, `?wait=N`, and streams of events.
use std::convert::Infallible;
use std::time::Duration;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Uri};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::{Stream, StreamExt};
use serde::Serialize;

use crate::extract::accept::choose;
use crate::extract::caller::{Caller, Credential, Tenant, revoked, revoked_meanwhile};
use crate::extract::query::{Parameters, Query, query, seconds};
use crate::limits::{ConcurrencyLimits, HeldPermits, Permit, hold_while_sent};
use crate::problem::{ApiError, Result};
use crate::render::format::Format;
use crate::state::AppState;
use railhead_jobs::Jobs;

/// Longest wait of one request in s.
pub(crate) const WAIT_MAX_SECONDS: u32 = 3600;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

query! {
    /// The parameter that asks to wait; [`Wait`] reads it.
    WaitQuery(() => ()) {
        /// Respond when the work has ended, or after this many seconds. `Prefer: wait=N` means the same, but is ignored while too many
        /// requests wait
        #[param(minimum = 0, maximum = 3600, example = 10)]
        wait: u32 as u32 = seconds(0, WAIT_MAX_SECONDS);
    }
}

/// The wait that a request asks for, and its place among the requests that wait. Handlers take it after the [`Caller`].
pub(crate) struct Wait {
    seconds: Option<u32>,
    preferred: bool,
    place: Option<Permit>,
    held: Option<HeldPermits>,
    key: Option<Credential>,
}

impl Wait {
    /// The wait, if there is one.
    pub(crate) fn at_most(&self) -> Option<Duration> {
        self.seconds
            .map(|seconds| Duration::from_secs(seconds.into()))
    }

    /// The place among the requests that wait, for an answer that waits while it is sent.
    pub(crate) fn into_place(self) -> Option<Permit> {
        if let (Some(_), Some(held)) = (self.seconds, &self.held) {
            held.release();
        }
        self.place
    }

    /// Runs what waits at most the time it is given. Returns `None` if the request does not ask to wait.
    ///
    /// # Errors
    /// The key of the request is revoked meanwhile.
    pub(crate) async fn hold<T>(
        &self,
        jobs: &Jobs,
        waiting: impl AsyncFnOnce(Duration) -> T,
    ) -> Result<Option<T>> {
        let Some(at_most) = self.at_most() else {
            return Ok(None);
        };
        // From here on the request only waits, which is counted apart.
        if let Some(held) = &self.held {
            held.release();
        }
        tokio::select! {
            value = waiting(at_most) => Ok(Some(value)),
            () = revoked(jobs.clone(), self.key.clone()) => Err(revoked_meanwhile()),
        }
    }

    /// Tells in a response that the preferred wait was applied.
    pub(crate) fn tell_applied(&self, mut response: Response) -> Response {
        let applied = self.seconds.filter(|_| self.preferred);
        let value =
            applied.and_then(|seconds| HeaderValue::from_str(&format!("wait={seconds}")).ok());
        if let Some(value) = value {
            response.headers_mut().insert(PREFERENCE_APPLIED, value);
        }
        response
    }
}

impl FromRequestParts<AppState> for Wait {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let concurrency = &state.concurrency;
        let tenant = parts.extensions.get::<Tenant>().cloned();
        let Tenant(tenant) = tenant.unwrap_or_else(|| Tenant("".into()));
        let (seconds, preferred, place) =
            match (wait_of(&parts.uri)?, preferred_wait(&parts.headers)) {
                (Some(seconds), _) => (
                    Some(seconds),
                    false,
                    Some(concurrency.require_wait(&tenant)?),
                ),
                (None, Some(seconds)) => match concurrency.wait(&tenant) {
                    Some(place) => (Some(seconds), true, Some(place)),
                    None => (None, false, None),
                },
                (None, None) => (None, false, None),
            };
        Ok(Wait {
            seconds,
            preferred,
            place,
            held: parts.extensions.get().cloned(),
            key: parts.extensions.get().cloned(),
        })
    }
}

/// The parameter `wait` of an address; others are for the route to read.
fn wait_of(uri: &Uri) -> Result<Option<u32>> {
    let mut query = Query::part_of(uri, &WaitQuery::names());
    let WaitQuery { wait } = WaitQuery::take(&mut query, &());
    query.finish()?;
    Ok(wait)
}

/// The wait that the client prefers, in s, capped. Preferences that are not understood are ignored (RFC 7240,
/// section 2); the first `wait` counts.
pub(crate) fn preferred_wait(headers: &HeaderMap) -> Option<u32> {
    let values = headers
        .get_all(&PREFER)
        .iter()
        .filter_map(|value| value.to_str().ok());
    let preferences = values.flat_map(|value| value.split([',', ';']));
    let mut waits = preferences.filter_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        let digits = value.trim().trim_matches('"');
        let whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        (name.trim().eq_ignore_ascii_case("wait") && whole)
            .then(|| digits.parse().unwrap_or(WAIT_MAX_SECONDS))
    });
    waits.next().map(|seconds| seconds.min(WAIT_MAX_SECONDS))
}

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

impl FromRequestParts<AppState> for EventRequest {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        let Caller(jobs) = Caller::from_request_parts(parts, state).await?;
        choose(&parts.headers, None, &[Format::Events])?;
        Ok(EventRequest {
            jobs,
            seen: last_event_id(&parts.headers),
            concurrency: state.concurrency.clone(),
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
    ) -> Result<Response> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn preference(prefer: &[&'static str]) -> Option<u32> {
        let mut headers = HeaderMap::new();
        for value in prefer {
            headers.append(PREFER, HeaderValue::from_static(value));
        }
        preferred_wait(&headers)
    }

    #[test]
    fn the_preferred_wait_is_read_and_capped() {
        assert_eq!(preference(&["wait=10"]), Some(10));
        assert_eq!(preference(&["respond-async, WAIT = \"7\""]), Some(7));
        assert_eq!(preference(&["handling=lenient", "wait=60"]), Some(60));
        assert_eq!(preference(&["wait=3601"]), Some(3600));
        assert_eq!(preference(&["wait=99999999999999999999"]), Some(3600));
        for ignored in [
            "wait",
            "wait=",
            "wait=-1",
            "wait=1.5",
            "wait=soon",
            "await=3",
        ] {
            assert_eq!(preference(&[ignored]), None, "{ignored}");
        }
    }
}
