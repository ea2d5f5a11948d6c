//! Caching by clients: entity tags, conditional requests, `Cache-Control`.
//!
//! A tag is strong (RFC 9110, section 8.8.3): a digest of the body, or for a result, which never changes, a digest of the request. The tag
//! of a compressed body is the digest followed by the coding.

use std::env::current_exe;
use std::fs::File;

use axum::body::Body;
use axum::extract::{Query as Pairs, Request};
use axum::http::response::Parts;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http_body_util::BodyExt;
use tokio::sync::OnceCell;
use uuid::Uuid;

use crate::problem::ApiError;
use crate::render::format::Format;
use railhead_jobs::model::{Job, State};

/// Policy of results, which never change but can be deleted.
const IMMUTABLE: HeaderValue = HeaderValue::from_static("private, max-age=3600");
/// Policy of resources that change: clients may store them, but revalidate them for each use.
const REVALIDATE: HeaderValue = HeaderValue::from_static("private, no-cache");
/// Policy of all other responses.
const NO_STORE: HeaderValue = HeaderValue::from_static("no-store");

/// Suffixes of the tags of compressed bodies.
const CODINGS: [&str; 2] = ["-gzip", "-zstd"];

/// Layer around resources that never change once they exist.
pub(crate) async fn immutable(request: Request, next: Next) -> Response {
    tag(request, next, IMMUTABLE).await
}

/// Layer around resources that change.
pub(crate) async fn revalidate(request: Request, next: Next) -> Response {
    tag(request, next, REVALIDATE).await
}

/// Layer around compression: forbids storing responses without a policy, and adds the coding to the tag of a compressed body.
pub(crate) async fn complete(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    if !headers.contains_key(header::CACHE_CONTROL) && !headers.contains_key(header::ETAG) {
        headers.insert(header::CACHE_CONTROL, NO_STORE);
    }
    let coding = headers
        .get(header::CONTENT_ENCODING)
        .and_then(|coding| coding.to_str().ok());
    let tag = headers
        .get(header::ETAG)
        .and_then(|tag| tag.to_str().ok()?.strip_suffix('"'));
    if let (Some(coding), Some(tag)) = (coding, tag)
        && let Ok(tag) = HeaderValue::from_str(&format!("{tag}-{coding}\""))
    {
        headers.insert(header::ETAG, tag);
    }
    response
}

/// Returns the tag of the result of a job, or of a part of it, and the response if the client has stored the result already. Nothing is
/// loaded for it.
///
/// Results never change, so job, path, query, format and the build of the program determine the tag. [`immutable`] handles
/// `If-None-Match: *`, because only the handler finds out whether there is a result.
pub(crate) async fn tag_of(
    job: &Job,
    uri: &Uri,
    headers: &HeaderMap,
    format: Format,
) -> (String, Option<Response>) {
    let query = Pairs::<Vec<(String, String)>>::try_from_uri(uri);
    let mut query = query.map_or_else(|_| Vec::new(), |Pairs(pairs)| pairs);
    query.sort();
    let parts = (job.id, job.version, uri.path(), query, format.name());
    let text = format!("{} {parts:?}", program_digest().await);
    let digest = digest(text.as_bytes());
    let known = matching(headers, &digest)
        .filter(|_| job.state == State::Succeeded && !asks_for_any(headers));
    let unchanged = known.map(|tag| {
        let head = [
            (header::ETAG, tag),
            (header::CACHE_CONTROL, IMMUTABLE),
            (header::VARY, HeaderValue::from_static("Accept")),
        ];
        (StatusCode::NOT_MODIFIED, head).into_response()
    });
    (digest, unchanged)
}

/// Returns the digest of the file of the program, which differs between builds and is the same on nodes with the same build.
async fn program_digest() -> &'static str {
    static DIGEST: OnceCell<String> = OnceCell::const_new();
    let read = || async {
        let read = tokio::task::spawn_blocking(|| {
            // This is the running program, even after its file was replaced.
            let file = File::open("/proc/self/exe").or_else(|_| File::open(current_exe()?))?;
            let mut hasher = blake3::Hasher::new();
            hasher.update_reader(file)?;
            Ok::<_, std::io::Error>(hasher.finalize().to_hex().to_string())
        });
        match read.await {
            Ok(Ok(digest)) => digest,
            unread => {
                tracing::warn!(
                    ?unread,
                    "the file of the program cannot be read; entity tags end with the process"
                );
                Uuid::now_v7().to_string()
            }
        }
    };
    DIGEST.get_or_init(read).await
}

/// Adds a tag to a response.
pub(crate) fn tagged(tag: &str, mut response: Response) -> Response {
    if let Ok(tag) = HeaderValue::from_str(&format!("\"{tag}\"")) {
        response.headers_mut().insert(header::ETAG, tag);
    }
    response
}

async fn tag(request: Request, next: Next, lifetime: HeaderValue) -> Response {
    let reading = matches!(*request.method(), Method::GET | Method::HEAD);
    let known = request.headers().clone();
    let response = next.run(request).await;
    if !reading || response.status() != StatusCode::OK {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    if parts.headers.contains_key(header::ETAG) {
        parts.headers.insert(header::CACHE_CONTROL, lifetime);
        if asks_for_any(&known) {
            return not_modified(parts);
        }
        return Response::from_parts(parts, body);
    }
    // The bodies of these resources are small and in memory already.
    let body = match body.collect().await {
        Ok(body) => body.to_bytes(),
        Err(error) => return ApiError::internal(&error).into_response(),
    };
    parts.headers.insert(header::CACHE_CONTROL, lifetime);
    let digest = digest(&body);
    if let Some(known) = matching(&known, &digest) {
        parts.headers.insert(header::ETAG, known);
        return not_modified(parts);
    }
    tagged(&digest, Response::from_parts(parts, Body::from(body)))
}

fn not_modified(mut parts: Parts) -> Response {
    parts.status = StatusCode::NOT_MODIFIED;
    parts.headers.remove(header::CONTENT_TYPE);
    parts.headers.remove(header::CONTENT_LENGTH);
    Response::from_parts(parts, Body::empty())
}

/// Whether `If-None-Match` is the wildcard `*`.
fn asks_for_any(headers: &HeaderMap) -> bool {
    let mut values = headers.get_all(header::IF_NONE_MATCH).iter();
    values.any(|value| value.as_bytes() == b"*")
}

fn digest(body: &[u8]) -> String {
    // 128 bits are enough: a client that finds a collision deceives only itself.
    blake3::hash(body).to_hex()[..32].to_owned()
}

/// Returns the tag in `If-None-Match` with this digest, in any coding, by weak comparison (RFC 9110, section 13.1.2).
fn matching(headers: &HeaderMap, digest: &str) -> Option<HeaderValue> {
    let values = headers.get_all(header::IF_NONE_MATCH).iter();
    let given = values.filter_map(|value| value.to_str().ok());
    let mut tags = given.flat_map(|value| value.split(',')).map(str::trim);
    let found = tags.find(|tag| {
        let inner = tag.trim_start_matches("W/").trim_matches('"');
        let plain = CODINGS
            .iter()
            .find_map(|coding| inner.strip_suffix(coding))
            .unwrap_or(inner);
        *tag == "*" || plain == digest
    })?;
    let own = format!("\"{digest}\"");
    HeaderValue::from_str(if found == "*" { &own } else { found }).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_match_weakly_and_in_every_coding() {
        let matches = |value: &'static str| {
            let mut headers = HeaderMap::new();
            headers.insert(header::IF_NONE_MATCH, HeaderValue::from_static(value));
            matching(&headers, "abc").is_some()
        };
        for value in [
            "*",
            "\"abc\"",
            "W/\"abc\"",
            "\"x\", \"abc-zstd\"",
            "\"abc-gzip\"",
        ] {
            assert!(matches(value), "{value}");
        }
        for value in ["\"ab\"", "\"abcd\"", "", "\"abc-br\""] {
            assert!(!matches(value), "{value}");
        }
        assert!(matching(&HeaderMap::new(), "abc").is_none());
    }
}
