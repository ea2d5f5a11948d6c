//! Compressed bodies of requests: which codings are accepted, and how much a body may unpack to.
//!
//! The limits of a body hold before and after it is unpacked, so a small body that unpacks to a large one is given up as soon
//! as the limit is passed, and one that unpacks to nothing cannot be sent for ever.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use async_compression::tokio::bufread::{GzipDecoder, ZstdDecoder};
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::TryStreamExt;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use tokio_util::io::{ReaderStream, StreamReader};

use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind};

/// Bytes that a packed batch may unpack to for each of its own; tables of numbers reach some 30.
const UNPACKED_PER_BYTE: u64 = 200;

/// Unpacked bytes up to which the ratio to the packed bytes is not checked.
const UNPACKED_FREE: u64 = 16 << 20;

/// The codings that a body may have.
const ACCEPTED: HeaderValue = HeaderValue::from_static("gzip, zstd");

/// Bytes of a packed body that have arrived; in the extensions of its request.
#[derive(Debug, Clone, Default)]
pub(crate) struct PackedLength(Arc<AtomicU64>);

impl PackedLength {
    /// Has a body that unpacked to so many bytes so far grown more than any honest one does?
    #[must_use]
    pub(crate) fn is_bomb(&self, unpacked: u64) -> bool {
        let packed = self.0.load(Ordering::Relaxed);
        unpacked > UNPACKED_FREE.saturating_add(packed.saturating_mul(UNPACKED_PER_BYTE))
    }

    /// Why such a body is refused.
    #[must_use]
    pub(crate) fn refusal() -> ApiError {
        ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "the body decompresses to more than {UNPACKED_PER_BYTE} times its size; send it in parts, or uncompressed"
            ),
        )
    }
}

/// Layer that unpacks bodies. It refuses unknown codings, and limits a packed body before it is unpacked.
pub(crate) async fn unpack(
    State(options): State<HttpOptions>,
    request: Request,
    next: Next,
) -> Response {
    let codings = request.headers().get_all(header::CONTENT_ENCODING);
    let codings: Vec<String> = codings
        .iter()
        .map(|value| value.to_str().unwrap_or("?").trim().to_ascii_lowercase())
        .collect();
    let is_gzip = match codings.as_slice() {
        [] => return next.run(request).await,
        [one] if one == "identity" => return next.run(request).await,
        [one] if one == "gzip" => true,
        [one] if one == "zstd" => false,
        _ => {
            let detail = format!(
                "`Content-Encoding` is `{}`; allowed: one of `gzip` and `zstd`, or none",
                codings.join(", ")
            );
            let mut refusal =
                ApiError::new(ProblemKind::UnsupportedEncoding, detail).into_response();
            refusal
                .headers_mut()
                .insert(header::ACCEPT_ENCODING, ACCEPTED);
            return refusal;
        }
    };
    let most = match request.uri().path() {
        "/v1/batches" => options.batch_max_bytes,
        "/v1/runs" => options.run_max_bytes,
        "/v1/evaluate" => options.evaluate_max_bytes as u64,
        _ => options.body_max_bytes as u64,
    };
    let declared = request.headers().get(header::CONTENT_LENGTH);
    let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if declared.is_some_and(|length| length > most) {
        return ApiError::new(
            ProblemKind::BodyTooLarge,
            format!("the compressed body is larger than the {most} bytes that are allowed"),
        )
        .into_response();
    }
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let packed = PackedLength::default();
    let arrived = packed.clone();
    let mut request = request.map(|body| {
        let counted = Limited::new(body, most).map_frame(move |frame| {
            let bytes = frame.data_ref().map_or(0, |data| data.len() as u64);
            arrived.0.fetch_add(bytes, Ordering::Relaxed);
            frame
        });
        unpacked(Body::new(counted), is_gzip)
    });
    request.extensions_mut().insert(packed);
    for name in [header::CONTENT_ENCODING, header::CONTENT_LENGTH] {
        request.headers_mut().remove(name);
    }
    next.run(request).await
}

/// A body without its gzip or zstd coding: all members of it (RFC 1952, RFC 8878), one after the other. Reading it fails if anything
/// follows the last member, or if that is not complete.
fn unpacked(body: Body, is_gzip: bool) -> Body {
    let packed = StreamReader::new(TryStreamExt::map_err(
        body.into_data_stream(),
        io::Error::other,
    ));
    if is_gzip {
        let mut members = GzipDecoder::new(packed);
        members.multiple_members(true);
        return Body::from_stream(ReaderStream::new(members));
    }
    let mut frames = ZstdDecoder::new(packed);
    frames.multiple_members(true);
    Body::from_stream(ReaderStream::new(frames))
}

/// Did reading a body fail because it passed a limit?
#[must_use]
pub(crate) fn too_long(error: &(dyn std::error::Error + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if error.is::<LengthLimitError>() {
            return true;
        }
        next = error.source();
    }
    false
}
