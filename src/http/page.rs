//! Answers `/` and the files of the page.

use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::extract::{Path as Segments, State};
use axum::http::{HeaderName, HeaderValue, Uri, header};
use axum::middleware::from_fn;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use rust_embed::Embed;

use crate::layers::etag;
use crate::problem::{Result, unknown_route};

/// The files of the page, as they are in the program.
#[derive(Embed)]
#[folder = "page/web/"]
struct Files;

/// Digest of all files: it changes with any of them, so that addresses with it may be kept for good.
static DIGEST: LazyLock<String> = LazyLock::new(|| {
    let mut hasher = blake3::Hasher::new();
    for (path, body) in
        Files::iter().filter_map(|path| Some((path.clone(), Files::get(&path)?.data)))
    {
        hasher.update(path.as_bytes());
        hasher.update(&(body.len() as u64).to_le_bytes());
        hasher.update(&body);
    }
    hasher.finalize().to_hex()[..16].to_owned()
});

/// What the page may do in a browser: run and load its own files, ask its own service, and nothing else. Text becomes HTML by the
/// templates of `lit-html` alone.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types lit-html",
);
/// For addresses with the digest of the files in them.
const FOR_GOOD: HeaderValue = HeaderValue::from_static("public, max-age=31536000, immutable");
/// For the same files at other addresses, as a page asks for that was loaded from another version.
const FOR_NOW: HeaderValue = HeaderValue::from_static("no-cache");
/// The first file, in which this stands for the path of the others.
const INDEX: &str = "index.html";
const BASE: &str = "/page/-/";

/// Where the files come from: from a folder while the page is worked on, else from the program.
type Folder = Option<Arc<Path>>;

/// The routes of the page.
pub(crate) fn routes<S: Clone + Send + Sync + 'static>(folder: Folder) -> Router<S> {
    Router::new()
        .route("/", get(index).route_layer(from_fn(etag::revalidate)))
        .route("/page/{digest}/{*path}", get(file))
        .with_state(folder)
}

async fn index(State(folder): State<Folder>, uri: Uri) -> Result<Response> {
    let body = load(folder.as_deref(), INDEX).await;
    let body = body.ok_or_else(|| unknown_route(uri.path()))?;
    let own = match folder {
        Some(_) => BASE.to_owned(),
        None => format!("/page/{}/", *DIGEST),
    };
    let text = String::from_utf8_lossy(&body).replace(BASE, &own);
    Ok((described(INDEX), text).into_response())
}

async fn file(
    State(folder): State<Folder>,
    Segments((digest, path)): Segments<(String, String)>,
    uri: Uri,
) -> Result<Response> {
    let body = load(folder.as_deref(), &path).await;
    let body = body.ok_or_else(|| unknown_route(uri.path()))?;
    let lifetime = match folder {
        None if digest == *DIGEST => FOR_GOOD,
        _ => FOR_NOW,
    };
    let lifetime = [(header::CACHE_CONTROL, lifetime)];
    Ok((described(&path), lifetime, body).into_response())
}

/// What a file holds; nothing if there is none.
async fn load(folder: Option<&Path>, path: &str) -> Option<Vec<u8>> {
    let Some(folder) = folder else {
        return Files::get(path).map(|file| file.data.into_owned());
    };
    let inside: PathBuf = path.into();
    let plain = |part: Component| matches!(part, Component::Normal(_));
    if !inside.components().all(plain) {
        return None;
    }
    tokio::fs::read(folder.join(inside)).await.ok()
}

fn described(path: &str) -> [(HeaderName, HeaderValue); 2] {
    let kind = match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("json") => "application/json",
        _ => "text/plain; charset=utf-8",
    };
    [
        (header::CONTENT_TYPE, HeaderValue::from_static(kind)),
        (header::CONTENT_SECURITY_POLICY, POLICY),
    ]
}
