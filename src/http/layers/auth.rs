//! Authentication: keys, requests without a key, pages of other origins, and requests per second.

use std::collections::HashMap;
use std::net::IpAddr;
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use governor::clock::{Clock, DefaultClock};
use governor::middleware::StateInformationMiddleware;
use governor::state::keyed::HashMapStateStore;
use governor::{Quota, RateLimiter};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tracing::field::display;

use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result};
use crate::server::connections::{Peer, ProbesOnly, network};
use railhead_jobs::Jobs;
use railhead_jobs::model::Key;
use railhead_jobs::sync::lock;

/// Paths of `POST` requests that change nothing.
const QUESTIONS: [&str; 2] = ["/v1/cases/check", "/v1/evaluate"];

/// Checks keys and rates of requests. Clones share their state.
#[derive(Debug, Clone)]
pub struct Access {
    /// The jobs of all tenants.
    pub jobs: Jobs,
    options: HttpOptions,
    rate: RateLimit,
}

impl Access {
    /// Creates the checks with these options.
    #[must_use]
    pub fn new(jobs: &Jobs, options: &HttpOptions) -> Access {
        Access {
            jobs: jobs.clone(),
            options: options.clone(),
            rate: RateLimit::new(options),
        }
    }

    /// Returns the key of a request; `None` for a request without a key, if these are allowed.
    ///
    /// # Errors
    /// `unauthorized`, `too-many-requests`, or the error of [`require_direct`].
    pub async fn key(&self, parts: &Parts) -> Result<Option<Key>> {
        let mut given = parts.headers.get_all(header::AUTHORIZATION).iter();
        let peer = parts.extensions.get::<Peer>().copied();
        let left = parts.extensions.get::<RateLeft>();
        let text = match (given.next(), given.next()) {
            (None, _) if self.options.anonymous => {
                require_direct(&self.options, parts)?;
                if let Some(sender) = peer.and_then(RateKey::at) {
                    self.rate.require_turn(sender, "this address", left)?;
                }
                return Ok(None);
            }
            (None, _) => {
                return Err(unauthorized(
                    "the request has no API key; send one with `Authorization: Bearer`",
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
        // Earlier wrong keys of the address count only against an unknown key: clients with valid keys may share the address.
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
                "this key is read-only; submit, cancel and delete jobs with another key of the tenant",
            ));
        }
        Ok(Some(key))
    }
}

/// Whether a request changes something. Checking a case and evaluating rows do not.
fn changes(parts: &Parts) -> bool {
    !matches!(parts.method, Method::GET | Method::HEAD) && !QUESTIONS.contains(&parts.uri.path())
}

pub(crate) fn unauthorized(detail: &str) -> ApiError {
    ApiError::new(ProblemKind::Unauthorized, detail)
}

/// Returns the credentials of `Bearer …`; the case of the scheme does not matter (RFC 9110, section 11.1).
pub(crate) fn bearer(header: &str) -> Option<&str> {
    let (scheme, key) = header.split_once(' ')?;
    let key = key.trim();
    (scheme.eq_ignore_ascii_case("bearer") && !key.is_empty()).then_some(key)
}

/// Headers that proxies add, about their clients or about themselves.
static FORWARDED: [HeaderName; 6] = [
    header::FORWARDED,
    header::VIA,
    HeaderName::from_static("x-forwarded-for"),
    HeaderName::from_static("x-forwarded-host"),
    HeaderName::from_static("x-forwarded-proto"),
    HeaderName::from_static("x-real-ip"),
];
/// Header with which a browser describes the page that sends the request.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Routes that are answered even if every connection is busy, and not traced.
pub(super) const PROBES: [&str; 3] = ["/healthz", "/readyz", "/metrics"];

/// Refuses requests without a key that do not come directly from a client or a page of this service.
///
/// # Errors
/// `host-not-allowed`, `cross-site` or `unauthorized`, with advice.
fn require_direct(options: &HttpOptions, parts: &Parts) -> Result<()> {
    require_host(options, parts)?;
    require_own_page(options, parts)?;
    let mut names = FORWARDED.iter();
    match names.find(|name| parts.headers.contains_key(*name)) {
        Some(name) if !options.anonymous_proxied => Err(ApiError::new(
            ProblemKind::Unauthorized,
            format!(
                "the request came through a proxy (`{name}`), so it needs an API key: send one with `Authorization: \
                     Bearer`. Without a key, only direct requests from this machine are answered (`--anonymous loopback`); \
                     `railhead keys create` creates keys"
            ),
        )),
        _ => Ok(()),
    }
}

/// Requires a name of the service in `Host`, or an address: a page can redirect a foreign name to this service, but not an address.
fn require_host(options: &HttpOptions, parts: &Parts) -> Result<()> {
    let Some(host) = host(parts) else {
        return Ok(());
    };
    let name = host.trim_matches(['[', ']']);
    let allowed = name.parse::<IpAddr>().is_ok()
        || name.eq_ignore_ascii_case("localhost")
        || options
            .allowed_hosts
            .iter()
            .any(|own| own.eq_ignore_ascii_case(name));
    if allowed {
        return Ok(());
    }
    Err(ApiError::new(
        ProblemKind::HostNotAllowed,
        format!(
            "the header `Host` is `{name}`; without a key it must be an IP address, `localhost` or a name given by `--allowed-host`"
        ),
    ))
}

/// Requires that a request that changes something comes from a page of this service, or not from a page.
fn require_own_page(options: &HttpOptions, parts: &Parts) -> Result<()> {
    if matches!(parts.method, Method::GET | Method::HEAD | Method::OPTIONS) {
        return Ok(());
    }
    let text = |name: &HeaderName| single(&parts.headers, name);
    let origin = text(&header::ORIGIN);
    let known = |origin: &str| {
        let own = origin.split_once("://").map(|(_, authority)| authority);
        // HTTP/2 has the name in the URI of the request.
        let host = parts.uri.authority().map(Authority::as_str);
        let host = host.or_else(|| text(&header::HOST));
        options.origins.iter().any(|allowed| allowed == origin) || (own.is_some() && own == host)
    };
    let foreign = match (origin, text(&FETCH_SITE)) {
        (Some(origin), _) => !known(origin),
        (None, Some(site)) => !matches!(site, "same-origin" | "none"),
        (None, None) => false,
    };
    if !foreign {
        return Ok(());
    }
    Err(ApiError::new(
        ProblemKind::CrossSite,
        format!(
            "a page of another origin ({}) may not change anything without a key; `--cors-origin` lists the origins that may",
            origin.unwrap_or("not named")
        ),
    ))
}

/// Returns the host of a request without its port; `None` if an old client does not send it.
fn host(parts: &Parts) -> Option<String> {
    let named = parts.uri.authority().cloned().or_else(|| {
        let text = single(&parts.headers, &header::HOST)?;
        text.parse::<Authority>().ok()
    });
    named.map(|authority| authority.host().to_owned())
}

fn single<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

/// Layer around all routes: requires one header `Host` of HTTP/1.1 requests (RFC 9112, section 3.2), and answers only the probes on
/// connections of the reserve.
pub(crate) async fn admit(request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let readable = |value: &HeaderValue| {
        let text = value.to_str().ok();
        text.is_some_and(|text| text.is_empty() || text.parse::<Authority>().is_ok())
    };
    let named = match (hosts.next(), hosts.next()) {
        (None, _) => request.version() != Version::HTTP_11,
        (Some(host), None) => readable(host),
        (Some(_), Some(_)) => false,
    };
    if !named {
        let detail =
            "a request of HTTP/1.1 has one header `Host` with the name and port of the service";
        return ApiError::bad_header("Host", detail).into_response();
    }
    let crowded = request.extensions().get::<ProbesOnly>().is_some();
    if crowded && !PROBES.contains(&request.uri().path()) {
        let detail = "every connection of the service, or of this address, has an active request";
        let mut refusal = ApiError::new(ProblemKind::Overloaded, detail).into_response();
        let close = HeaderValue::from_static("close");
        refusal.headers_mut().insert(header::CONNECTION, close);
        return refusal;
    }
    next.run(request).await
}

/// Size of a burst, as the number of seconds whose requests it contains.
const BURST_SECONDS: u32 = 2;

/// Number of remembered senders beyond which those without recent requests are forgotten.
const SENDERS_KEPT: usize = 10_000;
/// Shortest time between two clean-ups, which scan all senders.
const FORGET_EVERY: Duration = Duration::from_secs(10);

/// Number of wrong keys of one address within [`FAILURES_WITHIN`] that are answered `401`; further ones get `429`. A judgement: more than
/// a person mistypes.
const FAILURES_MAX: u32 = 20;
const FAILURES_WITHIN: Duration = Duration::from_secs(10);

/// The sender of requests, whose requests are counted together.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum RateKey {
    Key(String),
    Address(IpAddr),
}

impl RateKey {
    /// Returns the sender of a request without a key. Requests over loopback are not counted, because a proxy may send them for many
    /// clients.
    pub(crate) fn at(peer: Peer) -> Option<RateKey> {
        let address = network(peer.0);
        (!address.is_loopback()).then_some(RateKey::Address(address))
    }
}

type Limiter =
    RateLimiter<RateKey, HashMapStateStore<RateKey>, DefaultClock, StateInformationMiddleware>;

/// Number of requests that the sender may still make, in the extensions of a request; the response reports it.
#[derive(Debug, Clone, Default)]
pub(crate) struct RateLeft(Arc<Mutex<Option<u32>>>);

impl RateLeft {
    fn note(&self, requests: u32) {
        *lock(&self.0) = Some(requests);
    }
}

const POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");
const LEFT: HeaderName = HeaderName::from_static("ratelimit");

/// Layer that adds the fields `RateLimit-Policy` and `RateLimit` of draft-ietf-httpapi-ratelimit-headers-10 to responses, with the number of
/// requests that the sender may still make. They are absent without a limit, and for senders that are not counted.
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
        // The time until the whole burst is available again.
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

/// The requests of senders per second, and their wrong keys. Clones share their state.
#[derive(Debug, Clone)]
pub(crate) struct RateLimit {
    per_second: u32,
    limiter: Option<Arc<Limiter>>,
    forgotten: Arc<Mutex<Instant>>,
    failures: Arc<Mutex<HashMap<IpAddr, Failures>>>,
    /// One permit, for looking up keys of addresses that sent many wrong keys.
    lookups: Arc<Semaphore>,
}

/// Wrong keys of one address.
#[derive(Debug, Clone, Copy)]
struct Failures {
    since: Instant,
    count: u32,
}

impl RateLimit {
    /// Creates the limits of these options.
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

    /// Counts a request of a sender, and stores in `left` how many more it may make.
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again.
    pub(crate) fn require_turn(
        &self,
        sender: RateKey,
        who: &str,
        left: Option<&RateLeft>,
    ) -> Result<()> {
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
                "{who} sends too many requests; allowed: {} per second, and {} at once",
                self.per_second,
                self.per_second.saturating_mul(BURST_SECONDS)
            ),
        )
        .after(seconds.max(1)))
    }

    /// Whether a clean-up is due.
    fn may_forget(&self) -> bool {
        let mut last = lock(&self.forgotten);
        let due = last.elapsed() > FORGET_EVERY;
        if due {
            *last = Instant::now();
        }
        due
    }

    /// Waits until a key of this address may be looked up. Addresses that sent many wrong keys look keys up one at a time, so that
    /// together they use at most one connection of the database.
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
            // The semaphore is never closed.
            true => self.lookups.clone().acquire_owned().await.ok(),
            false => None,
        }
    }

    /// Counts a wrong key.
    ///
    /// # Errors
    /// `too-many-requests`, with the seconds after which to try again: the address has sent too many of them.
    pub(crate) fn count_failure(&self, address: Option<IpAddr>) -> Result<()> {
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
    fn only_bearer_credentials_are_read() {
        assert_eq!(bearer("Bearer rh_a_b"), Some("rh_a_b"));
        assert_eq!(bearer("bearer  rh_a_b "), Some("rh_a_b"));
        for other in ["Bearer", "Bearer ", "Basic YTpi", "rh_a_b"] {
            assert_eq!(bearer(other), None, "{other}");
        }
    }

    fn allowed(method: Method, headers: &[(&str, &str)]) -> bool {
        let options = HttpOptions {
            allowed_hosts: ["rail.example".to_owned()].into(),
            origins: ["https://dash.example".to_owned()].into(),
            ..HttpOptions::default()
        };
        let mut request = Request::builder().method(method).uri("/v1/jobs");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let (parts, ()) = request.body(()).unwrap().into_parts();
        require_direct(&options, &parts).is_ok()
    }

    #[test]
    fn names_that_lead_here_are_not_the_services_own() {
        for host in [
            "localhost",
            "localhost:8080",
            "127.0.0.1:1",
            "[::1]:80",
            "192.0.2.7",
            "Rail.Example:9",
        ] {
            assert!(allowed(Method::GET, &[("host", host)]), "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:8080",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
        ] {
            assert!(!allowed(Method::GET, &[("host", host)]), "{host}");
        }
    }

    #[test]
    fn pages_of_other_origins_change_nothing() {
        let host = ("host", "localhost:8080");
        for header in [
            ("origin", "http://localhost:8080"),
            ("origin", "https://dash.example"),
            ("sec-fetch-site", "same-origin"),
            ("sec-fetch-site", "none"),
        ] {
            assert!(allowed(Method::POST, &[host, header]), "{header:?}");
        }
        for header in [
            ("origin", "null"),
            ("origin", "http://localhost:3000"),
            ("origin", "https://evil.example"),
            ("sec-fetch-site", "cross-site"),
            ("sec-fetch-site", "same-site"),
        ] {
            assert!(!allowed(Method::POST, &[host, header]), "{header:?}");
            assert!(!allowed(Method::DELETE, &[host, header]), "{header:?}");
            assert!(allowed(Method::GET, &[host, header]), "{header:?}");
        }
    }

    #[test]
    fn what_a_proxy_passes_on_needs_a_key() {
        for name in &FORWARDED {
            assert!(!allowed(
                Method::GET,
                &[("host", "localhost"), (name.as_str(), "x")]
            ));
        }
    }

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
