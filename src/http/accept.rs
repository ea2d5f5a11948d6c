//! Content negotiation: JSON is what there is, so a request that excludes it is refused.

use axum::extract::Request;
use axum::http::{HeaderMap, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::http::error::{ApiError, Kind};

/// Refuses requests whose `Accept` excludes `application/json`.
pub async fn require_json(request: Request, next: Next) -> Response {
    if accepts_json(request.headers()) {
        return next.run(request).await;
    }
    let given: Vec<&str> = accept_values(request.headers()).collect();
    let detail = format!(
        "`Accept` is `{}`; this resource answers `application/json` only",
        given.join(", ")
    );
    ApiError::new(Kind::NotAcceptable, detail).into_response()
}

/// Does `Accept` (RFC 9110, section 12.5.1) allow `application/json`? The most specific range decides; without the
/// header everything is allowed.
fn accepts_json(headers: &HeaderMap) -> bool {
    if !headers.contains_key(header::ACCEPT) {
        return true;
    }
    let mut decision = (0, false);
    for range in accept_values(headers).flat_map(|value| value.split(',')) {
        let mut parts = range.split(';').map(str::trim);
        let specificity = match parts
            .next()
            .unwrap_or_default()
            .to_ascii_lowercase()
            .as_str()
        {
            "application/json" => 3,
            "application/*" => 2,
            "*/*" => 1,
            _ => continue,
        };
        let quality = parts
            .filter_map(|part| part.split_once('='))
            .find(|(name, _)| name.trim().eq_ignore_ascii_case("q"))
            .map_or(1.0, |(_, value)| value.trim().parse().unwrap_or(0.0));
        if specificity >= decision.0 {
            decision = (specificity, quality > 0.0);
        }
    }
    decision.1
}

fn accept_values(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    headers
        .get_all(header::ACCEPT)
        .iter()
        .map(|value| value.to_str().unwrap_or("?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_specific_range_decides() {
        let accepts = |value: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT, value.parse().unwrap());
            accepts_json(&headers)
        };
        for value in [
            "*/*",
            "application/*",
            "application/json",
            "text/html, */*;q=0.8",
            "Application/JSON;q=0.1",
            "text/csv;q=1, application/json; q=0.5",
        ] {
            assert!(accepts(value), "{value} allows JSON");
        }
        for value in [
            "text/csv",
            "application/json;q=0",
            "*/*, application/json;q=0",
            "application/xml, text/*",
            "application/problem+json",
            "",
        ] {
            assert!(!accepts(value), "{value} excludes JSON");
        }
        assert!(accepts_json(&HeaderMap::new()));
    }
}
