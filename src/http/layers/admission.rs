//! Compressed bodies of requests: accepted codings and limits of the decompressed size.
//!
//! The size limit of a body holds before and after it is decompressed. A small body that decompresses to a large one is therefore refused
//! when it exceeds the limit, and so is a large one that decompresses to nothing.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use async_compression::tokio::bufread::{GzipDecoder, ZstdDecoder};
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::TryStreamExt;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use tokio_util::io::{ReaderStream, StreamReader};

use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind};

/// Largest ratio of decompressed to compressed bytes; tables of numbers reach about 30.
const UNPACKED_PER_BYTE: u64 = 200;

/// Decompressed bytes up to which the ratio is not checked.
const UNPACKED_FREE: u64 = 16 << 20;

/// The accepted codings.
const ACCEPTED: HeaderValue = HeaderValue::from_static("gzip, zstd");

/// Number of compressed bytes that have arrived, in the extensions of a request.
#[derive(Debug, Clone, Default)]
pub(crate) struct PackedLength(Arc<AtomicU64>);

impl PackedLength {
    /// Whether a body with this many decompressed bytes so far exceeds the ratio.
    #[must_use]
    pub(crate) fn is_bomb(&self, unpacked: u64) -> bool {
        let packed = self.0.load(Ordering::Relaxed);
        unpacked > UNPACKED_FREE.saturating_add(packed.saturating_mul(UNPACKED_PER_BYTE))
    }

    /// Returns the refusal of such a body.
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

/// Returns the number in the header `Content-Length`.
pub(crate) fn declared_length(headers: &HeaderMap) -> Option<u64> {
    let value = headers.get(header::CONTENT_LENGTH)?;
    value.to_str().ok()?.parse().ok()
}

/// Layer that decompresses bodies. It refuses unknown codings, and limits the size of the compressed body.
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
    if declared_length(request.headers()).is_some_and(|length| length > most) {
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

/// Decompresses all members of a gzip or zstd body (RFC 1952, RFC 8878). Reading fails if anything follows the last member, or if it is
/// not complete.
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

/// Whether reading a body failed because it exceeded its limit.
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
