//! Who asks? API keys, tenants, requests per second.

use std::net::{IpAddr, Ipv6Addr};
use std::num::NonZeroU32;
use std::sync::Arc;

use axum::extract::FromRequestParts;
use axum::http::header;
use axum::http::request::Parts;
use governor::clock::{Clock, DefaultClock};
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};
use tracing::field::display;

use crate::http::error::{ApiError, Kind};
use crate::http::{HttpOptions, Shared};
use crate::jobs::Jobs;
use crate::jobs::keys::{ANONYMOUS, OPERATOR};

/// Requests that a key may send at once, in seconds of its rate.
const BURST_SECONDS: u32 = 2;

/// Senders beyond which those that have not asked for a while are forgotten.
const SENDERS_KEPT: usize = 10_000;

/// The address that a request comes from; in its extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peer(pub IpAddr);

/// Whose requests are counted together.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Sender {
    Key(String),
    Address(IpAddr),
}

impl Sender {
    /// The sender of a request without a key. Loopback is this machine itself, perhaps a proxy that speaks for many: not
    /// counted. One customer has a whole IPv6 network of 64 bits.
    fn at(peer: Peer) -> Option<Sender> {
        match peer.0.to_canonical() {
            address if address.is_loopback() => None,
            IpAddr::V6(address) => {
                let network = address.to_bits() >> 64 << 64;
                Some(Sender::Address(Ipv6Addr::from_bits(network).into()))
            }
            address => Some(Sender::Address(address)),
        }
    }
}

/// The jobs that the client may see: those of its tenant. Every handler that touches jobs takes this.
#[derive(Debug, Clone)]
pub struct Caller(pub Jobs);

/// A client that may read the figures of the whole service.
#[derive(Debug, Clone)]
pub struct Operator(pub Jobs);

/// All jobs, for what concerns no tenant.
#[derive(Debug, Clone)]
pub struct Unscoped(pub Jobs);

/// Who may ask, and how often; clones share it.
#[derive(Debug, Clone)]
pub struct Access {
    jobs: Jobs,
    anonymous: bool,
    limiter: Option<Arc<RateLimiter<Sender, HashMapStateStore<Sender>, DefaultClock>>>,
}

impl Access {
    /// The rules of these options.
    #[must_use]
    pub fn new(jobs: &Jobs, options: HttpOptions) -> Access {
        let per_second = NonZeroU32::new(options.requests_per_second);
        let limiter = per_second.map(|rate| {
            let burst = rate.saturating_mul(BURST_SECONDS.try_into().unwrap_or(NonZeroU32::MIN));
            Arc::new(RateLimiter::hashmap(
                Quota::per_second(rate).allow_burst(burst),
            ))
        });
        Access {
            jobs: jobs.clone(),
            anonymous: options.anonymous,
            limiter,
        }
    }

    /// The tenant that a request belongs to; `None` for a request without a key where that is allowed.
    async fn tenant(&self, parts: &Parts) -> Result<Option<Arc<str>>, ApiError> {
        let mut given = parts.headers.get_all(header::AUTHORIZATION).iter();
        let text = match (given.next(), given.next()) {
            (None, _) if self.anonymous => {
                let peer = parts.extensions.get::<Peer>().copied();
                if let Some(sender) = peer.and_then(Sender::at) {
                    self.require_turn(sender, "this address")?;
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
        let key = self.jobs.key(text).await?;
        let key = key.ok_or_else(|| unauthorized("the key is not known, or was revoked"))?;
        let span = tracing::Span::current();
        span.record("tenant", display(&key.tenant));
        span.record("key", display(&key.id));
        self.require_turn(Sender::Key(key.id), "this key")?;
        Ok(Some(key.tenant))
    }

    /// Counts a request of a sender.
    fn require_turn(&self, sender: Sender, who: &str) -> Result<(), ApiError> {
        let Some(limiter) = &self.limiter else {
            return Ok(());
        };
        if limiter.len() > SENDERS_KEPT {
            limiter.retain_recent();
        }
        let Err(early) = limiter.check_key(&sender) else {
            return Ok(());
        };
        let wait = early.wait_time_from(DefaultClock::default().now());
        let seconds = u32::try_from(wait.as_secs_f64().ceil() as u64).unwrap_or(u32::MAX);
        Err(ApiError::new(
            Kind::TooManyRequests,
            format!("{who} sends more requests per second than it may"),
        )
        .after(seconds.max(1)))
    }
}

impl FromRequestParts<Shared> for Caller {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, shared: &Shared) -> Result<Self, ApiError> {
        let access = &shared.access;
        let tenant = access.tenant(parts).await?;
        let tenant = tenant.unwrap_or_else(|| ANONYMOUS.into());
        Ok(Caller(access.jobs.of(tenant)))
    }
}

impl FromRequestParts<Shared> for Operator {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, shared: &Shared) -> Result<Self, ApiError> {
        let access = &shared.access;
        match access.tenant(parts).await? {
            Some(tenant) if *tenant != *OPERATOR => Err(ApiError::new(
                Kind::Forbidden,
                format!("only keys of the tenant `{OPERATOR}` may read this"),
            )),
            _ => Ok(Operator(access.jobs.clone())),
        }
    }
}

fn unauthorized(detail: &str) -> ApiError {
    ApiError::new(Kind::Unauthorized, detail)
}

/// The credentials of `Bearer …`; the scheme's case does not matter (RFC 9110, section 11.1).
fn bearer(header: &str) -> Option<&str> {
    let (scheme, key) = header.split_once(' ')?;
    let key = key.trim();
    (scheme.eq_ignore_ascii_case("bearer") && !key.is_empty()).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn senders_without_a_key_are_their_addresses() {
        let sender = |text: &str| Sender::at(Peer(text.parse().unwrap()));
        for here in ["127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"] {
            assert_eq!(sender(here), None, "{here}");
        }
        assert_eq!(sender("192.0.2.1"), sender("::ffff:192.0.2.1"));
        assert_ne!(sender("192.0.2.1"), sender("192.0.2.2"));
        assert_eq!(sender("2001:db8:1:2::3"), sender("2001:db8:1:2:ffff::4"));
        assert_ne!(sender("2001:db8:1:2::3"), sender("2001:db8:1:3::3"));
    }

    #[test]
    fn only_bearer_credentials_are_read() {
        assert_eq!(bearer("Bearer rh_a_b"), Some("rh_a_b"));
        assert_eq!(bearer("bearer  rh_a_b "), Some("rh_a_b"));
        for other in ["Bearer", "Bearer ", "Basic YTpi", "rh_a_b"] {
            assert_eq!(bearer(other), None, "{other}");
        }
    }
}
