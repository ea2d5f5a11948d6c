//! Compressed bodies: gzip and zstd, in both directions.
//!
//! The limits of a body hold before and after it is unpacked, so a small body that unpacks to a large one is given up as soon
//! as the limit is passed, and one that unpacks to nothing cannot be sent for ever.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{Extensions, HeaderMap, HeaderValue, StatusCode, Version, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http_body_util::{BodyExt, LengthLimitError, Limited};
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};

use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::Kind;

/// Bodies that are smaller do not become smaller.
const SMALLEST: u64 = 256;

/// Bytes that a packed batch may unpack to for each of its own; tables of numbers reach some 30.
const UNPACKED_PER_BYTE: u64 = 200;

/// Bytes up to which nobody asks how small they were before.
const UNPACKED_FREE: u64 = 16 << 20;

/// The codings that a body may have.
const ACCEPTED: HeaderValue = HeaderValue::from_static("gzip, zstd");

/// Marks an answer whose lines are wanted as they come, which packing would hold back.
#[derive(Debug, Clone, Copy)]
pub struct AsItComes;

/// Packs answers for clients that accept it; not what is packed already, and not what is sent as it comes.
pub fn packing() -> CompressionLayer<impl Predicate> {
    let not_live = |_: StatusCode, _: Version, _: &HeaderMap, extensions: &Extensions| {
        extensions.get::<AsItComes>().is_none()
    };
    CompressionLayer::new().gzip(true).zstd(true).compress_when(
        SizeAbove::new(SMALLEST)
            .and(NotForContentType::SSE)
            .and(NotForContentType::const_new("image/png"))
            .and(NotForContentType::const_new("application/x-npz"))
            .and(not_live),
    )
}

/// How much of a packed body has arrived; in the extensions of its request.
#[derive(Debug, Clone, Default)]
pub struct Packed(Arc<AtomicU64>);

impl Packed {
    /// Has a body that so far unpacked to so many bytes grown out of all proportion?
    #[must_use]
    pub fn is_bomb(&self, unpacked: u64) -> bool {
        let packed = self.0.load(Ordering::Relaxed);
        unpacked > UNPACKED_FREE.saturating_add(packed.saturating_mul(UNPACKED_PER_BYTE))
    }

    /// Why such a body is refused.
    #[must_use]
    pub fn refusal() -> ApiError {
        ApiError::new(
            Kind::BodyTooLarge,
            format!(
                "the body unpacks to more than {UNPACKED_PER_BYTE} times its size; send it in parts, or as it is"
            ),
        )
    }
}

/// Refuses codings that cannot be unpacked, and limits a packed body before it is; layer around the unpacking.
pub async fn limit_packed(
    State(options): State<HttpOptions>,
    request: Request,
    next: Next,
) -> Response {
    let codings = request.headers().get_all(header::CONTENT_ENCODING);
    let codings: Vec<String> = codings
        .iter()
        .map(|value| value.to_str().unwrap_or("?").trim().to_ascii_lowercase())
        .collect();
    match codings.as_slice() {
        [] => return next.run(request).await,
        [one] if one == "identity" => return next.run(request).await,
        [one] if one == "gzip" || one == "zstd" => {}
        _ => {
            let detail = format!(
                "`Content-Encoding` is `{}`; allowed: one of `gzip` and `zstd`, or none",
                codings.join(", ")
            );
            let mut refusal = ApiError::new(Kind::UnsupportedEncoding, detail).into_response();
            refusal
                .headers_mut()
                .insert(header::ACCEPT_ENCODING, ACCEPTED);
            return refusal;
        }
    }
    let most = if request.uri().path() == "/v1/batches" {
        options.batch_max_bytes
    } else {
        options.body_max_bytes as u64
    };
    let declared = request.headers().get(header::CONTENT_LENGTH);
    let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if declared.is_some_and(|length| length > most) {
        return ApiError::new(
            Kind::BodyTooLarge,
            format!("the packed body is larger than the {most} bytes that are allowed"),
        )
        .into_response();
    }
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let packed = Packed::default();
    let arrived = packed.clone();
    let mut request = request.map(|body| {
        let counted = Limited::new(body, most).map_frame(move |frame| {
            let bytes = frame.data_ref().map_or(0, |data| data.len() as u64);
            arrived.0.fetch_add(bytes, Ordering::Relaxed);
            frame
        });
        Body::new(counted)
    });
    request.extensions_mut().insert(packed);
    next.run(request).await
}

/// Did reading a body fail because it passed a limit?
#[must_use]
pub fn too_long(error: &(dyn std::error::Error + 'static)) -> bool {
    let mut next = Some(error);
    while let Some(error) = next {
        if error.is::<LengthLimitError>() {
            return true;
        }
        next = error.source();
    }
    false
}
