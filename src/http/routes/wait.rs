//! Waiting requests (`Prefer: wait=N`, `?wait=N`) and event streams.

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
use crate::extract::caller::{Credential, Tenant, revoked, revoked_meanwhile};
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
    /// The parameter for a wait, which [`Wait`] reads.
    WaitQuery {
        /// Respond when the work has ended, or after this many seconds. `Prefer: wait=N` means the same, but is ignored while too many
        /// requests wait
        #[param(minimum = 0, maximum = 3600, example = 10)]
        wait: u32 as u32 = seconds(0, WAIT_MAX_SECONDS);
    }
}

/// The requested wait, and the permit to wait. Handlers extract it after the caller.
pub(crate) struct Wait {
    seconds: Option<u32>,
    preferred: bool,
    place: Option<Permit>,
    held: Option<HeldPermits>,
    key: Option<Credential>,
}

impl Wait {
    /// Returns the longest time to wait.
    pub(crate) fn at_most(&self) -> Option<Duration> {
        self.seconds
            .map(|seconds| Duration::from_secs(seconds.into()))
    }

    /// Returns the permit to wait, for a response that waits while it is sent.
    pub(crate) fn into_place(self) -> Option<Permit> {
        if let (Some(_), Some(held)) = (self.seconds, &self.held) {
            held.release();
        }
        self.place
    }

    /// Runs `waiting` with the longest time to wait. Returns `None` if the request does not ask to wait.
    ///
    /// # Errors
    /// The key of the request is revoked in the meantime.
    pub(crate) async fn hold<T>(
        &self,
        jobs: &Jobs,
        waiting: impl AsyncFnOnce(Duration) -> T,
    ) -> Result<Option<T>> {
        let Some(at_most) = self.at_most() else {
            return Ok(None);
        };
        // A waiting request is counted separately.
        if let Some(held) = &self.held {
            held.release();
        }
        tokio::select! {
            value = waiting(at_most) => Ok(Some(value)),
            () = revoked(jobs.clone(), self.key.clone()) => Err(revoked_meanwhile()),
        }
    }

    /// Adds the header `Preference-Applied` for an applied `Prefer: wait`.
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
        let tenant = Tenant::of(&parts.extensions);
        let (asked, preferred) = (wait_of(&parts.uri)?, preferred_wait(&parts.headers));
        let place = match asked {
            Some(_) => Some(concurrency.require_wait(&tenant)?),
            None => preferred.and_then(|_| concurrency.wait(&tenant)),
        };
        Ok(Wait {
            seconds: asked.or(preferred).filter(|_| place.is_some()),
            preferred: asked.is_none(),
            place,
            held: parts.extensions.get().cloned(),
            key: parts.extensions.get().cloned(),
        })
    }
}

/// Returns the parameter `wait` of a URI; the route reads the others.
fn wait_of(uri: &Uri) -> Result<Option<u32>> {
    let mut query = Query::part_of(uri, &WaitQuery::names());
    let WaitQuery { wait } = WaitQuery::take(&mut query);
    query.finish()?;
    Ok(wait)
}

/// Returns the wait that the client prefers in s, at most [`WAIT_MAX_SECONDS`]. Unknown preferences are ignored (RFC 7240, section 2); the
/// first `wait` counts.
fn preferred_wait(headers: &HeaderMap) -> Option<u32> {
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

/// Interval of comments on an idle stream, which keep proxies from closing the connection.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// Time after which a client should reconnect.
const RETRY: Duration = Duration::from_secs(1);

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// A request for an event stream. Handlers extract it after the caller.
pub(crate) struct EventRequest {
    /// The id of the last event that the client received.
    pub seen: Option<String>,
    concurrency: ConcurrencyLimits,
    held: HeldPermits,
    key: Option<Credential>,
}

impl FromRequestParts<AppState> for EventRequest {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self> {
        choose(&parts.headers, None, &[Format::Events])?;
        Ok(EventRequest {
            seen: last_event_id(&parts.headers),
            concurrency: state.concurrency.clone(),
            held: parts.extensions.get().cloned().unwrap_or_default(),
            key: parts.extensions.get().cloned(),
        })
    }
}

impl EventRequest {
    /// Returns the stream as a response. It counts as a stream of the tenant instead of a request, and ends when the key is revoked.
    ///
    /// # Errors
    /// The limit of event streams is reached.
    pub(crate) fn answer(
        self,
        jobs: Jobs,
        events: impl Stream<Item = Result<Event, Infallible>> + Send + 'static,
    ) -> Result<Response> {
        let place = self.concurrency.stream(jobs.tenant())?;
        self.held.release();
        let events = events.take_until(revoked(jobs, self.key));
        let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE));
        Ok(hold_while_sent(events.into_response(), place))
    }
}

/// Returns the change, if there is one. A failure ends the stream; the client then reconnects.
pub(crate) fn changed<T>(change: Result<Option<T>, impl std::fmt::Display>) -> Option<T> {
    change
        .inspect_err(|reason| tracing::debug!(%reason, "a stream of events ended early"))
        .ok()
        .flatten()
}

/// Creates an event; `id` identifies the version that it reports.
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
