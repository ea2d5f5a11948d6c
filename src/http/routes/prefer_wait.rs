//! `Prefer: wait=N` (RFC 7240): an answer that waits for the end of a job.

use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::response::Response;
use uuid::Uuid;

use crate::http::limits::concurrency::ConcurrencyLimits;
use crate::http::limits::holding_body::HeldShares;
use crate::http::problem::error::ApiError;
use crate::jobs::Jobs;

/// Longest time that `Prefer: wait` holds a request, in s.
pub const WAIT_MAX_SECONDS: u32 = 60;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// The wait that the client prefers, in s, capped. Preferences that are not understood are ignored (RFC 7240,
/// section 2); the first `wait` counts.
pub fn preferred_wait(headers: &HeaderMap) -> Option<u32> {
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

/// Waits for the end of a job for as long as `Prefer` says; returns the wait in s if one was applied.
///
/// # Errors
/// There is no such job.
pub async fn wait_for_end(
    jobs: &Jobs,
    crowds: &ConcurrencyLimits,
    held: &HeldShares,
    id: Uuid,
    headers: &HeaderMap,
) -> Result<Option<u32>, ApiError> {
    let Some(seconds) = preferred_wait(headers) else {
        return Ok(None);
    };
    let Some(_place) = crowds.wait(jobs.tenant()) else {
        return Ok(None);
    };
    // From here on the request only waits, which is counted apart.
    held.release();
    jobs.wait(id, Duration::from_secs(seconds.into())).await?;
    Ok(Some(seconds))
}

/// Says which wait was applied.
pub fn say_applied(mut response: Response, seconds: Option<u32>) -> Response {
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
