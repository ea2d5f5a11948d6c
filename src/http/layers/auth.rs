//! Whose request is it? API keys and their tenants.

use axum::http::request::Parts;
use axum::http::{Method, header};
use tracing::field::display;

use crate::http::layers::origin_guard::Guard;
use crate::http::layers::rate_limit::{RateKey, RateLeft, RateLimit};
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::server::connections::Peer;
use crate::jobs::Jobs;
use crate::jobs::model::key::Key;

/// Paths where a body is sent and nothing is changed.
const QUESTIONS: [&str; 2] = ["/v1/cases/check", "/v1/evaluate"];

/// Who may ask, and how often; clones share it.
#[derive(Debug, Clone)]
pub struct Access {
    /// All jobs, whoever they belong to.
    pub jobs: Jobs,
    anonymous: bool,
    guard: Guard,
    rate: RateLimit,
}

impl Access {
    /// The rules of these options.
    #[must_use]
    pub fn new(jobs: &Jobs, options: &HttpOptions) -> Access {
        Access {
            jobs: jobs.clone(),
            anonymous: options.anonymous,
            guard: Guard::new(options),
            rate: RateLimit::new(options),
        }
    }

    /// The key of a request; `None` for a request without a key where that is allowed.
    ///
    /// # Errors
    /// `unauthorized`, `too-many-requests`, or what [`Guard::require_direct`] says.
    pub async fn key(&self, parts: &Parts) -> Result<Option<Key>, ApiError> {
        let mut given = parts.headers.get_all(header::AUTHORIZATION).iter();
        let peer = parts.extensions.get::<Peer>().copied();
        let left = parts.extensions.get::<RateLeft>();
        let text = match (given.next(), given.next()) {
            (None, _) if self.anonymous => {
                self.guard.require_direct(parts)?;
                if let Some(sender) = peer.and_then(RateKey::at) {
                    self.rate.require_turn(sender, "this address", left)?;
                }
                return Ok(None);
            }
            (None, _) => {
                return Err(unauthorized(
                    "the request has no key; send `Authorization: Bearer` with one",
                ));
            }
            (Some(header), None) => header.to_str().ok().and_then(bearer),
            (Some(_), Some(_)) => None,
        };
        let text = text.ok_or_else(|| {
            unauthorized("the header `Authorization` is not `Bearer` followed by one key")
        })?;
        let address = peer.and_then(|peer| match RateKey::at(peer) {
            Some(RateKey::Address(address)) => Some(address),
            _ => None,
        });
        // Only an unknown key is refused for the wrong ones before it: clients with good keys may have the same address.
        let known = match self.jobs.remembered_key(text) {
            Some(key) => Some(key),
            None => {
                let _turn = self.rate.lookup_turn(address).await;
                self.jobs.key(text).await?
            }
        };
        let Some(key) = known else {
            self.rate.count_failure(address)?;
            return Err(unauthorized("the key is not known, or was revoked"));
        };
        let span = tracing::Span::current();
        span.record("tenant", display(&key.tenant));
        span.record("key", display(&key.id));
        self.rate
            .require_turn(RateKey::Key(key.id.clone()), "this key", left)?;
        if key.read_only && changes(parts) {
            return Err(ApiError::new(
                ProblemKind::Forbidden,
                "this key may only read; make, cancel and delete jobs with another key of the tenant",
            ));
        }
        Ok(Some(key))
    }
}

/// Would this request change anything? Checking a case and evaluating rows does not.
fn changes(parts: &Parts) -> bool {
    !matches!(parts.method, Method::GET | Method::HEAD) && !QUESTIONS.contains(&parts.uri.path())
}

pub(crate) fn unauthorized(detail: &str) -> ApiError {
    ApiError::new(ProblemKind::Unauthorized, detail)
}

/// The credentials of `Bearer …`; the scheme's case does not matter (RFC 9110, section 11.1).
pub(crate) fn bearer(header: &str) -> Option<&str> {
    let (scheme, key) = header.split_once(' ')?;
    let key = key.trim();
    (scheme.eq_ignore_ascii_case("bearer") && !key.is_empty()).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_bearer_credentials_are_read() {
        assert_eq!(bearer("Bearer rh_a_b"), Some("rh_a_b"));
        assert_eq!(bearer("bearer  rh_a_b "), Some("rh_a_b"));
        for other in ["Bearer", "Bearer ", "Basic YTpi", "rh_a_b"] {
            assert_eq!(bearer(other), None, "{other}");
        }
    }
}
