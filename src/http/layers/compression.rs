//! Compressed answers: gzip and zstd.

use axum::http::{Extensions, HeaderMap, StatusCode, Version};
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};

/// Bodies that are smaller do not become smaller.
const SMALLEST: u64 = 256;

/// Marks an answer whose lines are wanted as they come, which packing would hold back.
#[derive(Debug, Clone, Copy)]
pub struct StreamedUnbuffered;

/// Packs answers for clients that accept it; not what is packed already, and not what is sent as it comes.
pub fn compression_layer() -> CompressionLayer<impl Predicate> {
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
