//! Ends JSON answers with a newline, so that the prompt of a terminal does not stick to them.

use std::convert::Infallible;

use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use futures_util::{StreamExt, TryStreamExt, stream};

/// Layer around everything that answers JSON, within compression.
pub(crate) async fn end_line(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    let media_type = response.headers().get(header::CONTENT_TYPE);
    let is_json = media_type.and_then(|value| value.to_str().ok());
    let is_json = is_json.is_some_and(|value| {
        value.starts_with("application/json") || value.starts_with("application/problem+json")
    });
    if !is_json || response.status() == StatusCode::NOT_MODIFIED {
        return response;
    }
    let named = response.headers().get(header::CONTENT_LENGTH);
    let named = named.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if let Some(size) = named.or_else(|| response.body().size_hint().exact()) {
        let size = HeaderValue::from(size + 1);
        response.headers_mut().insert(header::CONTENT_LENGTH, size);
    }
    // The body of an answer to HEAD is dropped further out.
    response.map(|body| {
        let newline = stream::once(async { Ok::<_, Infallible>(Bytes::from_static(b"\n")) });
        let newline = newline.map_err(axum::Error::new);
        Body::from_stream(body.into_data_stream().chain(newline))
    })
}
