//! Who may ask without a key? Not a web page of another origin, and not a client behind a proxy.
//!
//! Where no key is needed, any page open in a browser on this machine could send requests too. `Host` reveals a page whose name
//! was made to resolve to this machine (DNS rebinding); `Sec-Fetch-Site` and `Origin` reveal a page of another origin. A proxy on
//! this machine would let in everybody who reaches it; the headers that it adds about its client reveal it.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, Method, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::server::connections::ProbesOnly;

/// Headers that proxies add, about their clients or about themselves.
static FORWARDED: [HeaderName; 6] = [
    header::FORWARDED,
    header::VIA,
    HeaderName::from_static("x-forwarded-for"),
    HeaderName::from_static("x-forwarded-host"),
    HeaderName::from_static("x-forwarded-proto"),
    HeaderName::from_static("x-real-ip"),
];
/// Header in which a browser describes the page that sends the request.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Routes that are answered even if every connection is busy.
const PROBES: [&str; 3] = ["/healthz", "/readyz", "/metrics"];

/// Conditions for requests without a key.
#[derive(Debug, Clone)]
pub(crate) struct Guard {
    hosts: Arc<[String]>,
    origins: Arc<[String]>,
    proxied: bool,
}

impl Guard {
    /// The rules of these options.
    #[must_use]
    pub(crate) fn new(options: &HttpOptions) -> Guard {
        Guard {
            hosts: options.allowed_hosts.clone(),
            origins: options.origins.clone(),
            proxied: options.anonymous_proxied,
        }
    }

    /// May a request without a key be answered?
    ///
    /// # Errors
    /// `host-not-allowed`, `cross-site` or `unauthorized`, with what to do.
    pub(crate) fn require_direct(&self, parts: &Parts) -> Result<(), ApiError> {
        self.require_host(parts)?;
        self.require_own_page(parts)?;
        let told = FORWARDED
            .iter()
            .find(|name| parts.headers.contains_key(*name));
        match told {
            Some(name) if !self.proxied => Err(ApiError::new(
                ProblemKind::Unauthorized,
                format!(
                    "the request came through a proxy (`{name}`), so it needs a key: send `Authorization: Bearer` with one. \
                     Without a key only direct requests of this machine are answered (`--anonymous loopback`); keys are made with \
                     `railhead keys create`"
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Is the service asked by a name that is its own? An address cannot be made to lead elsewhere, a name can.
    fn require_host(&self, parts: &Parts) -> Result<(), ApiError> {
        let Some(host) = host(parts) else {
            return Ok(());
        };
        let name = host.trim_matches(['[', ']']);
        let allowed = name.parse::<IpAddr>().is_ok()
            || name.eq_ignore_ascii_case("localhost")
            || self.hosts.iter().any(|own| own.eq_ignore_ascii_case(name));
        if allowed {
            return Ok(());
        }
        Err(ApiError::new(
            ProblemKind::HostNotAllowed,
            format!(
                "the service is asked as `{name}`; without a key it answers to addresses, to `localhost` and to names given by `--allowed-host`"
            ),
        ))
    }

    /// Does a request that changes something come from a page of this service, or from no page at all?
    fn require_own_page(&self, parts: &Parts) -> Result<(), ApiError> {
        if matches!(parts.method, Method::GET | Method::HEAD | Method::OPTIONS) {
            return Ok(());
        }
        let text = |name: &HeaderName| single(&parts.headers, name);
        let origin = text(&header::ORIGIN);
        let known = |origin: &str| {
            let own = origin.split_once("://").map(|(_, authority)| authority);
            // HTTP/2 has the name in the address of the request.
            let asked = parts.uri.authority().map(Authority::as_str);
            let asked = asked.or_else(|| text(&header::HOST));
            self.origins.iter().any(|allowed| allowed == origin) || (own.is_some() && own == asked)
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
                "a page of another origin ({}) may not change anything here without a key; `--cors-origin` names the origins that may",
                origin.unwrap_or("not named")
            ),
        ))
    }
}

/// The host that a request is for, without its port; `None` if an old client does not say it.
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

/// Layer around everything: a request of HTTP/1.1 says its host once (RFC 9112, section 3.2), and a connection without a
/// place of its own may ask for the probes only.
pub(crate) async fn admit(request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let readable = |value: &axum::http::HeaderValue| {
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
        let detail = "every connection of the service, or of this address, has a request under way";
        let mut refusal = ApiError::new(ProblemKind::Overloaded, detail).into_response();
        let close = axum::http::HeaderValue::from_static("close");
        refusal.headers_mut().insert(header::CONNECTION, close);
        return refusal;
    }
    next.run(request).await
}

#[cfg(test)]
mod tests {
    use super::*;

    fn allowed(method: Method, headers: &[(&str, &str)]) -> bool {
        let guard = Guard {
            hosts: ["rail.example".to_owned()].into(),
            origins: ["https://dash.example".to_owned()].into(),
            proxied: false,
        };
        let mut request = Request::builder().method(method).uri("/v1/jobs");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let (parts, ()) = request.body(()).unwrap().into_parts();
        guard.require_direct(&parts).is_ok()
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
}
