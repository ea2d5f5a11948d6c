//! `Prefer: wait=N` (RFC 7240): an answer that waits for the end of a job.

use std::time::Duration;

use axum::extract::{FromRef, FromRequestParts};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::response::Response;
use uuid::Uuid;

use crate::http::extract::caller::{Caller, revoked, revoked_meanwhile};
use crate::http::extract::ids::JobId;
use crate::http::layers::auth::Access;
use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::HeldShares;
use crate::http::problem::error::ApiError;
use crate::jobs::Jobs;

/// Longest time that `Prefer: wait` holds a request, in s.
pub(crate) const WAIT_MAX_SECONDS: u32 = 60;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

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

/// The job in the path, once it has ended or the wait that the client prefers is over.
pub(crate) struct Awaited {
    /// The jobs of the client.
    pub jobs: Jobs,
    /// The job in the path.
    pub id: Uuid,
    /// The wait in s, if one was applied.
    pub applied: Option<u32>,
}

impl<S: Send + Sync> FromRequestParts<S> for Awaited
where
    Access: FromRef<S>,
    ConcurrencyLimits: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let Caller(jobs) = Caller::from_request_parts(parts, state).await?;
        let JobId(id) = JobId::from_request_parts(parts, state).await?;
        let crowds = ConcurrencyLimits::from_ref(state);
        let place = preferred_wait(&parts.headers)
            .and_then(|seconds| Some((seconds, crowds.wait(jobs.tenant())?)));
        let mut applied = None;
        if let Some((seconds, _place)) = place {
            // From here on the request only waits, which is counted apart.
            if let Some(held) = parts.extensions.get::<HeldShares>() {
                held.release();
            }
            let key = parts.extensions.get().cloned();
            tokio::select! {
                ended = jobs.wait(id, Duration::from_secs(seconds.into())) => drop(ended?),
                () = revoked(jobs.clone(), key) => return Err(revoked_meanwhile()),
            }
            applied = Some(seconds);
        }
        Ok(Awaited { jobs, id, applied })
    }
}

/// Says which wait was applied.
pub(crate) fn say_applied(mut response: Response, seconds: Option<u32>) -> Response {
    let value = seconds.and_then(|seconds| HeaderValue::from_str(&format!("wait={seconds}")).ok());
    if let Some(value) = value {
        response.headers_mut().insert(PREFERENCE_APPLIED, value);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait_of(prefer: &[&'static str]) -> Option<u32> {
        let mut headers = HeaderMap::new();
        for value in prefer {
            headers.append(PREFER, HeaderValue::from_static(value));
        }
        preferred_wait(&headers)
    }

    #[test]
    fn the_preferred_wait_is_read_and_capped() {
        assert_eq!(wait_of(&["wait=10"]), Some(10));
        assert_eq!(wait_of(&["respond-async, WAIT = \"7\""]), Some(7));
        assert_eq!(wait_of(&["handling=lenient", "wait=60"]), Some(60));
        assert_eq!(wait_of(&["wait=61"]), Some(60));
        assert_eq!(wait_of(&["wait=99999999999999999999"]), Some(60));
        for ignored in [
            "wait",
            "wait=",
            "wait=-1",
            "wait=1.5",
            "wait=soon",
            "await=3",
        ] {
            assert_eq!(wait_of(&[ignored]), None, "{ignored}");
        }
    }
}
