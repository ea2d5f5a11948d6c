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

/// The files of the page, embedded in the program.
#[derive(Embed)]
#[folder = "page/web/"]
struct Files;

/// Digest of all files. It changes with any of them, so that responses at paths with the digest never change.
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

/// Policy of the page: it loads only its own files and calls only its own service. Only the templates of `lit-html` turn text into HTML.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types lit-html",
);
/// Caching of files at paths with the digest.
const IMMUTABLE: HeaderValue = HeaderValue::from_static("public, max-age=31536000, immutable");
/// Caching of files at other paths, which a page of another version requests.
const REVALIDATE: HeaderValue = HeaderValue::from_static("no-cache");
/// The first file.
const INDEX: &str = "index.html";
/// Placeholder in the first file for the path of the others.
const BASE: &str = "/page/-/";

/// The folder with the files, for development of the page; `None` for the embedded files.
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
        None if digest == *DIGEST => IMMUTABLE,
        _ => REVALIDATE,
    };
    let lifetime = [(header::CACHE_CONTROL, lifetime)];
    Ok((described(&path), lifetime, body).into_response())
}

/// Returns the content of a file; `None` if it does not exist.
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
