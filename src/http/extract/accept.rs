//! Content negotiation: JSON unless a resource offers more.

use axum::extract::{Query as Pairs, Request};
use axum::http::{HeaderMap, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::extract::query::{Reader, reader};
use crate::problem::{ApiError, ProblemKind, Result};
use crate::render::format::Format;

/// Layer that refuses requests for another format than JSON, by `format` or because `Accept` excludes `application/json`.
pub async fn require_json(request: Request, next: Next) -> Response {
    let named = named_format(request.uri());
    if let Some(other) = named.as_deref().filter(|name| *name != Format::Json.name()) {
        let detail = format!("`format` is `{other}`; this resource answers `json` only");
        return ApiError::new(ProblemKind::NotAcceptable, detail).into_response();
    }
    let named = named.map(|_| Format::Json);
    match choose(request.headers(), named, &[Format::Json]) {
        Ok(_) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

/// Returns the reader of the name of one of these formats.
pub fn one_of(offered: &'static [Format]) -> Reader<Format> {
    let names: Vec<String> = offered
        .iter()
        .map(|format| format!("`{}`", format.name()))
        .collect();
    reader(names.join(", "), |text| {
        offered.iter().copied().find(|format| format.name() == text)
    })
}

/// Chooses the format of a response: the named one, else the one that `Accept` prefers; of equals the first.
///
/// # Errors
/// `not-acceptable`: `Accept` excludes every offered format.
pub fn choose(headers: &HeaderMap, named: Option<Format>, offered: &[Format]) -> Result<Format> {
    if let Some(format) = named {
        return Ok(format);
    }
    let essence = |format: Format| format.media_type().split(';').next().unwrap_or_default();
    let mut best = None;
    for format in offered.iter().copied() {
        let quality = quality(headers, essence(format));
        if quality > best.map_or(0.0, |(_, quality)| quality) {
            best = Some((format, quality));
        }
    }
    best.map(|(format, _)| format).ok_or_else(|| {
        let offered: Vec<String> = offered
            .iter()
            .map(|format| format!("`{}`", essence(*format)))
            .collect();
        let given: Vec<&str> = accept_values(headers).collect();
        let only = if offered.len() == 1 { " only" } else { "" };
        let detail = format!(
            "`Accept` is `{}`; this resource answers {}{only}",
            given.join(", "),
            offered.join(", ")
        );
        ApiError::new(ProblemKind::NotAcceptable, detail)
    })
}

/// Returns the parameter `format` of a URI.
fn named_format(uri: &Uri) -> Option<String> {
    let Pairs(pairs) = Pairs::<Vec<(String, String)>>::try_from_uri(uri).ok()?;
    let format = pairs.into_iter().find(|(name, _)| name == "format");
    format.map(|(_, value)| value)
}

/// Returns the quality of a media type by `Accept` (RFC 9110, section 12.5.1), from 0 to 1. The most specific range decides; without the
/// header the quality is 1.
fn quality(headers: &HeaderMap, media_type: &str) -> f64 {
    if !headers.contains_key(header::ACCEPT) {
        return 1.0;
    }
    let family = media_type.split('/').next().unwrap_or_default();
    let mut decision = (0, 0.0);
    for range in accept_values(headers).flat_map(|value| value.split(',')) {
        let mut parts = range.split(';').map(str::trim);
        let range = parts.next().unwrap_or_default().to_ascii_lowercase();
        let specificity = if range == media_type {
            3
        } else if range.strip_suffix("/*") == Some(family) {
            2
        } else if range == "*/*" {
            1
        } else {
            continue;
        };
        let quality = parts
            .filter_map(|part| part.split_once('='))
            .find(|(name, _)| name.trim().eq_ignore_ascii_case("q"))
            .map_or(1.0, |(_, value)| value.trim().parse().unwrap_or(0.0));
        if specificity >= decision.0 {
            decision = (specificity, quality);
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
            choose(&headers, None, &[Format::Json]).is_ok()
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
        assert!(choose(&HeaderMap::new(), None, &[Format::Json]).is_ok());
    }
}
