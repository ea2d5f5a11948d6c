//! Requests per second of a key or an address, and wrong keys from one address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue};
use axum::middleware::Next;
use axum::response::Response;
use governor::clock::{Clock, DefaultClock};
use governor::middleware::StateInformationMiddleware;
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::server::connections::Peer;
use crate::http::server::connections::network;
use crate::jobs::sync::lock;

/// Size of a burst: the requests of so many seconds.
const BURST_SECONDS: u32 = 2;

/// Senders that are remembered; beyond this number, those without recent requests are forgotten.
const SENDERS_KEPT: usize = 10_000;
/// Shortest time between two clean-ups, which visit all senders.
const FORGET_EVERY: Duration = Duration::from_secs(10);

/// Wrong keys of one address within [`FAILURES_WITHIN`] that are answered `401`, further ones `429`. Chosen by judgement: more than
/// anybody mistypes.
const FAILURES_MAX: u32 = 20;
const FAILURES_WITHIN: Duration = Duration::from_secs(10);

/// Requests with the same value are counted together.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum RateKey {
    Key(String),
    Address(IpAddr),
}

impl RateKey {
    /// The sender of a request without a key. Requests over loopback are not counted: they may come from a proxy on behalf of many
    /// clients.
    pub(crate) fn at(peer: Peer) -> Option<RateKey> {
        let address = network(peer.0);
        (!address.is_loopback()).then_some(RateKey::Address(address))
    }
}

type Limiter =
    RateLimiter<RateKey, HashMapStateStore<RateKey>, DefaultClock, StateInformationMiddleware>;

/// What is left of the rate of the sender of a request; in its extensions, so that its answer can say so.
#[derive(Debug, Clone, Default)]
pub(crate) struct RateLeft(Arc<Mutex<Option<u32>>>);

impl RateLeft {
    fn note(&self, requests: u32) {
        *lock(&self.0) = Some(requests);
    }
}

const POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");
const LEFT: HeaderName = HeaderName::from_static("ratelimit");

/// Layer in which answers say how many requests the sender may still make, as the fields `RateLimit-Policy` and `RateLimit` of
/// draft-ietf-httpapi-ratelimit-headers-10 do. Without a limit, or for senders that are not counted, they are absent.
pub(crate) async fn add_rate_limit_headers(
    per_second: u32,
    mut request: Request,
    next: Next,
) -> Response {
    let left = RateLeft::default();
    request.extensions_mut().insert(left.clone());
    let mut response = next.run(request).await;
    let left = *lock(&left.0);
    if let Some(left) = left {
        let burst = per_second.saturating_mul(BURST_SECONDS);
        // Until everything is there again.
        let seconds = burst.saturating_sub(left).div_ceil(per_second.max(1));
        let fields = [
            (POLICY, format!("\"requests\";q={burst};w={BURST_SECONDS}")),
            (LEFT, format!("\"requests\";r={left};t={seconds}")),
        ];
        for (name, text) in fields {
            if let Ok(value) = HeaderValue::from_str(&text) {
                response.headers_mut().insert(name, value);
            }
        }
    }
    response
}

/// How often senders may ask; clones share it.
#[derive(Debug, Clone)]
pub(crate) struct RateLimit {
    per_second: u32,
    limiter: Option<Arc<Limiter>>,
    forgotten: Arc<Mutex<Instant>>,
    failures: Arc<Mutex<HashMap<IpAddr, Failures>>>,
    /// One turn, for look-ups of addresses that sent many wrong keys.
    lookups: Arc<Semaphore>,
}

/// Wrong keys from one address.
#[derive(Debug, Clone, Copy)]
struct Failures {
    since: Instant,
    count: u32,
}

impl RateLimit {
    /// The limits of these options.
    #[must_use]
    pub(crate) fn new(options: &HttpOptions) -> RateLimit {
        let per_second = NonZeroU32::new(options.requests_per_second);
        let limiter = per_second.map(|rate| {
            let burst = rate.saturating_mul(BURST_SECONDS.try_into().unwrap_or(NonZeroU32::MIN));
            let limiter = RateLimiter::hashmap(Quota::per_second(rate).allow_burst(burst));
            Arc::new(limiter.with_middleware::<StateInformationMiddleware>())
        });
        RateLimit {
            per_second: options.requests_per_second,
            limiter,
            forgotten: Arc::new(Mutex::new(Instant::now())),
            failures: Arc::default(),
            lookups: Arc::new(Semaphore::new(1)),
        }
    }

    /// Counts a request of a sender, and notes in `left` how many more it may make.
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again.
    pub(crate) fn require_turn(
        &self,
        sender: RateKey,
        who: &str,
        left: Option<&RateLeft>,
    ) -> Result<(), ApiError> {
        let Some(limiter) = &self.limiter else {
            return Ok(());
        };
        if limiter.len() > SENDERS_KEPT && self.may_forget() {
            limiter.retain_recent();
        }
        let note = |requests| left.inspect(|left| left.note(requests));
        let early = match limiter.check_key(&sender) {
            Ok(state) => {
                note(state.remaining_burst_capacity());
                return Ok(());
            }
            Err(early) => early,
        };
        note(0);
        let wait = early.wait_time_from(DefaultClock::default().now());
        let seconds = u32::try_from(wait.as_secs_f64().ceil() as u64).unwrap_or(u32::MAX);
        Err(ApiError::new(
            ProblemKind::TooManyRequests,
            format!(
                "{who} sends more requests than it may: {} per second, and {} at once",
                self.per_second,
                self.per_second.saturating_mul(BURST_SECONDS)
            ),
        )
        .after(seconds.max(1)))
    }

    /// Is it time for another clean-up?
    fn may_forget(&self) -> bool {
        let mut last = lock(&self.forgotten);
        let due = last.elapsed() > FORGET_EVERY;
        if due {
            *last = Instant::now();
        }
        due
    }

    /// Waits for the turn of an address to look a key up that is not remembered. Addresses that sent many wrong keys take turns, so that
    /// together they keep one connection of the database busy at most.
    pub(crate) async fn lookup_turn(
        &self,
        address: Option<IpAddr>,
    ) -> Option<OwnedSemaphorePermit> {
        let many = {
            let failures = lock(&self.failures);
            let of_address = address.and_then(|address| failures.get(&address));
            of_address.is_some_and(|failures| {
                failures.count >= FAILURES_MAX && failures.since.elapsed() < FAILURES_WITHIN
            })
        };
        match many {
            // It is never closed.
            true => self.lookups.clone().acquire_owned().await.ok(),
            false => None,
        }
    }

    /// Counts a wrong key.
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again: the address has sent too many of them.
    pub(crate) fn count_failure(&self, address: Option<IpAddr>) -> Result<(), ApiError> {
        let Some(address) = address else {
            return Ok(());
        };
        let mut failures = lock(&self.failures);
        if failures.len() > SENDERS_KEPT {
            failures.retain(|_, failures| failures.since.elapsed() < FAILURES_WITHIN);
        }
        let new = Failures {
            since: Instant::now(),
            count: 0,
        };
        let own = failures.entry(address).or_insert(new);
        if own.since.elapsed() >= FAILURES_WITHIN {
            *own = new;
        }
        own.count = own.count.saturating_add(1);
        if own.count <= FAILURES_MAX {
            return Ok(());
        }
        let left = FAILURES_WITHIN.saturating_sub(own.since.elapsed());
        let seconds = u32::try_from(left.as_secs()).unwrap_or(u32::MAX);
        Err(ApiError::new(
            ProblemKind::TooManyRequests,
            format!(
                "the key is not known, and this address sent more than {FAILURES_MAX} wrong keys within {} s",
                FAILURES_WITHIN.as_secs()
            ),
        )
        .after(seconds.saturating_add(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn senders_without_a_key_are_their_addresses() {
        let sender = |text: &str| RateKey::at(Peer(text.parse().unwrap()));
        for here in ["127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"] {
            assert_eq!(sender(here), None, "{here}");
        }
        assert_eq!(sender("192.0.2.1"), sender("::ffff:192.0.2.1"));
        assert_ne!(sender("192.0.2.1"), sender("192.0.2.2"));
        assert_eq!(sender("2001:db8:1:2::3"), sender("2001:db8:1:2:ffff::4"));
        assert_ne!(sender("2001:db8:1:2::3"), sender("2001:db8:1:3::3"));
    }
}
