//! Who asks? API keys, tenants, requests per second.

use std::collections::HashMap;
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::{FromRef, FromRequestParts};
use axum::http::header;
use axum::http::request::Parts;
use governor::clock::{Clock, DefaultClock};
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};
use tracing::field::display;

use crate::http::layers::origin_guard::Guard;
use crate::http::limits::concurrency::Crowds;
use crate::http::limits::holding_body::Held;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::Kind;
use crate::http::server::connection::Peer;
use crate::http::server::places::network;
use crate::jobs::Jobs;
use crate::jobs::keys::{ANONYMOUS, OPERATOR};

/// Requests that a key may send at once, in seconds of its rate.
const BURST_SECONDS: u32 = 2;

/// Senders beyond which those that have not asked for a while are forgotten.
const SENDERS_KEPT: usize = 10_000;
/// How often that is done at most: it looks at all of them.
const FORGET_EVERY: Duration = Duration::from_secs(10);

/// Wrong keys that one address may send in [`FAILURES_WITHIN`]; each costs a look into the table.
const FAILURES_MAX: u32 = 20;
const FAILURES_WITHIN: Duration = Duration::from_secs(10);

/// Whose request it is, once that is known; in its extensions.
#[derive(Debug, Clone)]
pub struct Tenant(pub Arc<str>);

/// The key that a request came with, to be looked at again while its answer goes on; in its extensions.
#[derive(Debug, Clone)]
pub struct Credential(Arc<str>);

/// How often the key of an answer that goes on is looked at.
const LOOK_AGAIN: Duration = Duration::from_secs(2);

/// Ends when the key that a request came with has been revoked; never without a key.
pub async fn revoked(jobs: Jobs, credential: Option<Credential>) {
    let Some(Credential(text)) = credential else {
        return std::future::pending().await;
    };
    loop {
        tokio::time::sleep(LOOK_AGAIN).await;
        // A table that does not answer revokes nothing.
        if matches!(jobs.key(&text).await, Ok(None)) {
            return;
        }
    }
}

/// Whose requests are counted together.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Sender {
    Key(String),
    Address(IpAddr),
}

impl Sender {
    /// The sender of a request without a key. Loopback is this machine itself, perhaps a proxy that speaks for many: not
    /// counted.
    fn at(peer: Peer) -> Option<Sender> {
        let address = network(peer.0);
        (!address.is_loopback()).then_some(Sender::Address(address))
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
    guard: Guard,
    per_second: u32,
    limiter: Option<Arc<RateLimiter<Sender, HashMapStateStore<Sender>, DefaultClock>>>,
    forgotten: Arc<Mutex<Instant>>,
    failures: Arc<Mutex<HashMap<IpAddr, Failures>>>,
}

/// Wrong keys from one address.
#[derive(Debug, Clone, Copy)]
struct Failures {
    since: Instant,
    count: u32,
}

impl Access {
    /// The rules of these options.
    #[must_use]
    pub fn new(jobs: &Jobs, options: &HttpOptions) -> Access {
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
            guard: Guard::new(options),
            per_second: options.requests_per_second,
            limiter,
            forgotten: Arc::new(Mutex::new(Instant::now())),
            failures: Arc::default(),
        }
    }

    /// The tenant that a request belongs to; `None` for a request without a key where that is allowed.
    async fn tenant(&self, parts: &Parts) -> Result<Option<Arc<str>>, ApiError> {
        let mut given = parts.headers.get_all(header::AUTHORIZATION).iter();
        let peer = parts.extensions.get::<Peer>().copied();
        let text = match (given.next(), given.next()) {
            (None, _) if self.anonymous => {
                self.guard.require_direct(parts)?;
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
        let address = peer.and_then(|peer| match Sender::at(peer) {
            Some(Sender::Address(address)) => Some(address),
            _ => None,
        });
        self.require_few_failures(address)?;
        let Some(key) = self.jobs.key(text).await? else {
            self.count_failure(address);
            return Err(unauthorized("the key is not known, or was revoked"));
        };
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
        if limiter.len() > SENDERS_KEPT && self.may_forget() {
            limiter.retain_recent();
        }
        let Err(early) = limiter.check_key(&sender) else {
            return Ok(());
        };
        let wait = early.wait_time_from(DefaultClock::default().now());
        let seconds = u32::try_from(wait.as_secs_f64().ceil() as u64).unwrap_or(u32::MAX);
        Err(ApiError::new(
            Kind::TooManyRequests,
            format!(
                "{who} sends more requests than it may: {} per second, and {} at once",
                self.per_second,
                self.per_second.saturating_mul(BURST_SECONDS)
            ),
        )
        .after(seconds.max(1)))
    }

    /// Is it time again to look for senders to forget?
    fn may_forget(&self) -> bool {
        let mut last = self
            .forgotten
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let due = last.elapsed() > FORGET_EVERY;
        if due {
            *last = Instant::now();
        }
        due
    }

    fn require_few_failures(&self, address: Option<IpAddr>) -> Result<(), ApiError> {
        let failures = self.failures.lock().unwrap_or_else(PoisonError::into_inner);
        let of_address = address.and_then(|address| failures.get(&address));
        let left = of_address
            .filter(|failures| failures.count >= FAILURES_MAX)
            .and_then(|failures| FAILURES_WITHIN.checked_sub(failures.since.elapsed()));
        match left {
            Some(left) => Err(ApiError::new(
                Kind::TooManyRequests,
                format!(
                    "this address sent {FAILURES_MAX} wrong keys within {} s",
                    FAILURES_WITHIN.as_secs()
                ),
            )
            .after(
                u32::try_from(left.as_secs())
                    .unwrap_or(u32::MAX)
                    .saturating_add(1),
            )),
            None => Ok(()),
        }
    }

    fn count_failure(&self, address: Option<IpAddr>) {
        let Some(address) = address else { return };
        let mut failures = self.failures.lock().unwrap_or_else(PoisonError::into_inner);
        if failures.len() > SENDERS_KEPT {
            failures.retain(|_, failures| failures.since.elapsed() < FAILURES_WITHIN);
        }
        let now = Instant::now();
        let own = failures.entry(address).or_insert(Failures {
            since: now,
            count: 0,
        });
        if own.since.elapsed() >= FAILURES_WITHIN {
            *own = Failures {
                since: now,
                count: 0,
            };
        }
        own.count += 1;
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Caller
where
    Access: FromRef<S>,
    Crowds: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let access = Access::from_ref(state);
        let tenant = access.tenant(parts).await?;
        let tenant = tenant.unwrap_or_else(|| ANONYMOUS.into());
        if let Some(held) = parts.extensions.get::<Held>() {
            held.add(Crowds::from_ref(state).request(&tenant)?);
        }
        parts.extensions.insert(Tenant(tenant.clone()));
        let key = parts.headers.get(header::AUTHORIZATION);
        if let Some(key) = key.and_then(|header| bearer(header.to_str().ok()?)) {
            let credential = Credential(key.into());
            parts.extensions.insert(credential);
        }
        Ok(Caller(access.jobs.of(tenant)))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Operator
where
    Access: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let access = Access::from_ref(state);
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
