//! A large body on its way.

use std::time::Duration;

use axum::body::{Body, BodyDataStream, Bytes};
use axum::extract::Request;
use axum::http::header;
use futures_util::StreamExt;
use tokio::time::{Instant, timeout_at};

use crate::http::layers::admission::{PackedLength, too_long};
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

/// Bytes per second of a body at least, on average and after a head start of the time that a piece may take: otherwise
/// one byte at a time could keep a connection and a file open for ever.
const LOWEST_RATE: f64 = 1024.0;

/// A body on its way, held to its limits of size and time.
pub struct BodyReader {
    timeout: Duration,
    max_bytes: u64,
    what: &'static str,
    pieces: BodyDataStream,
    packed: Option<PackedLength>,
    total: u64,
    begun: Instant,
}

impl BodyReader {
    /// The body of a request: `what` it is, the time that a piece of it may take, and its largest size.
    ///
    /// # Errors
    /// The body says itself that it is too large.
    pub fn new(
        timeout: Duration,
        max_bytes: u64,
        what: &'static str,
        request: Request<Body>,
    ) -> Result<BodyReader, ApiError> {
        let declared = request.headers().get(header::CONTENT_LENGTH);
        let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
        let packed = request.extensions().get::<PackedLength>().cloned();
        let reader = BodyReader {
            timeout,
            max_bytes,
            what,
            pieces: request.into_body().into_data_stream(),
            packed,
            total: 0,
            begun: Instant::now(),
        };
        if declared.is_some_and(|length| length > max_bytes) {
            return Err(reader.too_large());
        }
        Ok(reader)
    }

    /// The next piece, or nothing at the end.
    ///
    /// # Errors
    /// It is too large, too slow, or breaks off.
    pub async fn next(&mut self) -> Result<Option<Bytes>, ApiError> {
        #[expect(clippy::cast_precision_loss, reason = "far fewer bytes than 2^53")]
        let owed = Duration::from_secs_f64(self.total as f64 / LOWEST_RATE);
        let latest = self.begun + self.timeout + owed;
        let piece = timeout_at(
            latest.min(Instant::now() + self.timeout),
            self.pieces.next(),
        );
        let piece = piece.await.map_err(|_| {
            ApiError::new(
                ProblemKind::BodyTimeout,
                format!(
                    "nothing of the body arrived for {} s, or all of it at less than {LOWEST_RATE} bytes per second",
                    self.timeout.as_secs_f64()
                ),
            )
        })?;
        let Some(piece) = piece else { return Ok(None) };
        let piece = piece.map_err(|error| {
            if too_long(&error) {
                self.too_large()
            } else {
                unreadable(&error)
            }
        })?;
        self.total += piece.len() as u64;
        if self.total > self.max_bytes {
            return Err(self.too_large());
        }
        let packed = self.packed.as_ref();
        if packed.is_some_and(|packed| packed.is_bomb(self.total)) {
            return Err(PackedLength::refusal());
        }
        Ok(Some(piece))
    }

    fn too_large(&self) -> ApiError {
        ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "the body is larger than the {} bytes that are allowed for {}",
                self.max_bytes, self.what
            ),
        )
    }
}

/// A body that broke off or could not be unpacked.
pub fn unreadable(error: &(dyn std::error::Error + 'static)) -> ApiError {
    let mut deepest = error;
    while let Some(next) = deepest.source() {
        deepest = next;
    }
    ApiError::new(
        ProblemKind::UnreadableBody,
        format!("the body broke off or cannot be unpacked: {deepest}"),
    )
}
