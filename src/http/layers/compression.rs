//! Compressed answers: gzip and zstd.

use axum::http::{Extensions, HeaderMap, StatusCode, Version};
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};

/// Smaller bodies do not shrink.
const SMALLEST: u64 = 256;

/// Marks an answer whose lines have to be sent at once; compression would delay them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StreamedUnbuffered;

/// Compresses answers for clients that accept it, except formats that are compressed already and answers marked [`StreamedUnbuffered`].
pub(crate) fn compression_layer() -> CompressionLayer<impl Predicate> {
    let not_live = |_: StatusCode, _: Version, _: &HeaderMap, extensions: &Extensions| {
        extensions.get::<StreamedUnbuffered>().is_none()
    };
    CompressionLayer::new().gzip(true).zstd(true).compress_when(
        SizeAbove::new(SMALLEST)
            .and(NotForContentType::SSE)
            .and(NotForContentType::const_new("image/png"))
            .and(NotForContentType::const_new("application/x-npz"))
            .and(not_live),
    )
}
