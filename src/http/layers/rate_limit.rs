//! Requests per second of a key or an address, and wrong keys from one address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use governor::clock::{Clock, DefaultClock};
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};

use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::server::connection::Peer;
use crate::http::server::places::network;

/// Size of a burst: the requests of so many seconds.
const BURST_SECONDS: u32 = 2;

/// Senders that are remembered; beyond this number, those without recent requests are forgotten.
const SENDERS_KEPT: usize = 10_000;
/// Shortest time between two clean-ups, which visit all senders.
const FORGET_EVERY: Duration = Duration::from_secs(10);

/// Wrong keys that one address may send within [`FAILURES_WITHIN`]; each costs a query of the key table.
const FAILURES_MAX: u32 = 20;
const FAILURES_WITHIN: Duration = Duration::from_secs(10);

/// Requests with the same value are counted together.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum RateKey {
    Key(String),
    Address(IpAddr),
}

impl RateKey {
    /// The sender of a request without a key. Requests over loopback are not counted: they may come from a proxy on behalf of many
    /// clients.
    pub fn at(peer: Peer) -> Option<RateKey> {
        let address = network(peer.0);
        (!address.is_loopback()).then_some(RateKey::Address(address))
    }
}

/// How often senders may ask; clones share it.
#[derive(Debug, Clone)]
pub struct RateLimit {
    per_second: u32,
    limiter: Option<Arc<RateLimiter<RateKey, HashMapStateStore<RateKey>, DefaultClock>>>,
    forgotten: Arc<Mutex<Instant>>,
    failures: Arc<Mutex<HashMap<IpAddr, Failures>>>,
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
    pub fn new(options: &HttpOptions) -> RateLimit {
        let per_second = NonZeroU32::new(options.requests_per_second);
        let limiter = per_second.map(|rate| {
            let burst = rate.saturating_mul(BURST_SECONDS.try_into().unwrap_or(NonZeroU32::MIN));
            Arc::new(RateLimiter::hashmap(
                Quota::per_second(rate).allow_burst(burst),
            ))
        });
        RateLimit {
            per_second: options.requests_per_second,
            limiter,
            forgotten: Arc::new(Mutex::new(Instant::now())),
            failures: Arc::default(),
        }
    }

    /// Counts a request of a sender.
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again.
    pub fn require_turn(&self, sender: RateKey, who: &str) -> Result<(), ApiError> {
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

    /// Has this address sent few enough wrong keys?
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again.
    pub fn require_few_failures(&self, address: Option<IpAddr>) -> Result<(), ApiError> {
        let failures = self.failures.lock().unwrap_or_else(PoisonError::into_inner);
        let of_address = address.and_then(|address| failures.get(&address));
        let left = of_address
            .filter(|failures| failures.count >= FAILURES_MAX)
            .and_then(|failures| FAILURES_WITHIN.checked_sub(failures.since.elapsed()));
        match left {
            Some(left) => Err(ApiError::new(
                ProblemKind::TooManyRequests,
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

    /// Counts a wrong key.
    pub fn count_failure(&self, address: Option<IpAddr>) {
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
