//! Reads bodies within limits of size and time, and as JSON without repeated members.

use std::time::Duration;

use axum::body::{Body, BodyDataStream, Bytes, HttpBody};
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, header};
use futures_util::StreamExt;
use serde_json::Value;
use tokio::time::{Instant, timeout_at};

use crate::extract::caller::Tenant;
use crate::layers::admission::{PackedLength, declared_length, too_long};
use crate::limits::{Memory, MemoryPermit, Permit, SMALL_BYTES};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result};
use crate::state::AppState;
use railhead_jobs::sync::blocking;
use railhead_tables::strict_json::Strict;

/// The JSON body of a request.
#[derive(Debug)]
pub struct JsonBody {
    /// The parsed body.
    pub value: Value,
    /// The permit for its memory, and the turn of a large body. It is held until the body has been checked.
    pub room: MemoryPermit,
}

impl FromRequest<AppState> for JsonBody {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &AppState) -> Result<Self> {
        let AppState {
            options, memory, ..
        } = state;
        require_json(request.headers())?;
        let tenant = Tenant::of(request.extensions());
        let (bytes, held) = read_whole(request, memory, &tenant, options).await?;
        let weight = weigh_in_turn(memory, &tenant, &bytes, options.parsed_max_bytes).await?;
        let share = memory.parsed(&tenant, weight).await?;
        if weight <= SMALL_BYTES {
            let value = read_json(&bytes)?;
            return Ok(JsonBody {
                value,
                room: MemoryPermit { share, turn: None },
            });
        }
        // Large bodies are parsed on blocking threads, a few at a time.
        let turn = memory.turn(&tenant, weight).await?;
        let room = MemoryPermit {
            share,
            turn: Some(turn),
        };
        let read = blocking(move || {
            let value = read_json(&bytes);
            drop((bytes, held));
            // The permit is held until the work ends, even if the client has disconnected.
            value.map(|value| JsonBody { value, room })
        });
        read.await?
    }
}

/// Returns the memory of a parsed case. Large texts are scanned on a blocking thread, because that would delay other requests.
async fn weigh_in_turn(
    memory: &Memory,
    tenant: &str,
    text: &Bytes,
    max_bytes: usize,
) -> Result<usize> {
    if text.len() <= SMALL_BYTES {
        return weigh_case(text, max_bytes);
    }
    let (text, turn) = (text.clone(), memory.turn(tenant, text.len()).await?);
    let weighed = blocking(move || {
        let _turn = turn;
        weigh_case(&text, max_bytes)
    });
    weighed.await?
}

/// Estimates the memory of a case once it is parsed, in bytes.
///
/// # Errors
/// `body-too-large`: the memory or the number of members exceeds the limit of a case.
pub fn weigh_case(text: &[u8], max_bytes: usize) -> Result<usize> {
    let Weight { bytes, members } = weigh(text);
    let detail = if bytes > max_bytes {
        format!("the case would take about {bytes} bytes in memory; allowed: {max_bytes}")
    } else if members > MEMBERS_MAX {
        format!("the objects of the case have {members} members; allowed: {MEMBERS_MAX}")
    } else {
        return Ok(bytes);
    };
    Err(ApiError::new(ProblemKind::BodyTooLarge, detail))
}

/// Parses JSON text (RFC 8259). A repeated member and a number beyond the range of `f64` are errors.
///
/// # Errors
/// `malformed-json` with its position.
pub fn read_json(text: &[u8]) -> Result<Value> {
    read_strict(text).map_err(|error| not_json(unlike_json(text), &error))
}

/// Returns the refusal of a body whose JSON cannot be read; `unlike` is the fault of its beginning, if there is one.
#[must_use]
pub fn not_json(unlike: Option<&str>, error: &serde_json::Error) -> ApiError {
    let refusal = ApiError::malformed(error);
    match unlike {
        Some(reason) => refusal.saying(format!("the body is not JSON: {reason}")),
        None => refusal,
    }
}

/// Returns the fault of a text that does not begin like JSON.
#[must_use]
pub fn unlike_json(text: &[u8]) -> Option<&'static str> {
    match text {
        [0xef, 0xbb, 0xbf, ..] => Some("it begins with a byte order mark; send UTF-8 without one"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("it is UTF-16; send UTF-8"),
        _ if text.iter().all(u8::is_ascii_whitespace) => Some("it is empty"),
        _ => None,
    }
}

/// Like [`read_json`], with the error of the parser.
///
/// # Errors
/// The text is not JSON.
pub fn read_strict(text: &[u8]) -> Result<Value, serde_json::Error> {
    serde_json::from_slice::<Strict>(text).map(|Strict(value)| value)
}

/// Returns the media type of a body without parameters, in lower case; empty if there is none.
#[must_use]
pub fn essence(headers: &HeaderMap) -> String {
    let given = headers.get(header::CONTENT_TYPE);
    let text = given.map_or("", |value| value.to_str().unwrap_or("?"));
    let essence = text.split(';').next().unwrap_or_default();
    essence.trim().to_ascii_lowercase()
}

/// Refuses a content type with another charset than UTF-8.
///
/// # Errors
/// `unsupported-media-type`
pub fn require_utf8(headers: &HeaderMap) -> Result<()> {
    let given = headers.get(header::CONTENT_TYPE);
    let text = given.map_or("", |value| value.to_str().unwrap_or("?"));
    for parameter in text.split(';').skip(1) {
        let (name, value) = parameter.split_once('=').unwrap_or_default();
        let value = value.trim().trim_matches('"');
        let known = ["utf-8", "utf8"].map(|known| value.eq_ignore_ascii_case(known));
        if name.trim().eq_ignore_ascii_case("charset") && !known.contains(&true) {
            return Err(ApiError::new(
                ProblemKind::UnsupportedMediaType,
                format!(
                    "the charset is `{value}`; send UTF-8, with `charset=utf-8` or without a charset"
                ),
            ));
        }
    }
    Ok(())
}

fn require_json(headers: &HeaderMap) -> Result<()> {
    require_utf8(headers)?;
    let subtype = essence(headers);
    if subtype == "application/json"
        || (subtype.starts_with("application/") && subtype.ends_with("+json"))
    {
        return Ok(());
    }
    let given = match headers.get(header::CONTENT_TYPE) {
        None => "no content type was given".to_owned(),
        Some(value) => format!("`{}` was given", value.to_str().unwrap_or("?")),
    };
    Err(ApiError::new(
        ProblemKind::UnsupportedMediaType,
        format!("{given}; send the case with `Content-Type: application/json`"),
    ))
}

/// Reads the whole body, and returns the permit for its memory. The permit is for the declared length. If the length is not known, as for a
/// compressed body, the permit is for the largest body, and taken as soon as the body is not small.
async fn read_whole(
    request: Request,
    memory: &Memory,
    tenant: &str,
    options: &HttpOptions,
) -> Result<(Bytes, Option<Permit>)> {
    let (max_bytes, within) = (options.body_max_bytes, options.body_timeout);
    let exact = request.body().size_hint().exact();
    let exact = exact.map_or(0, |bytes| usize::try_from(bytes).unwrap_or(max_bytes));
    let mut reader = BodyReader::new(within, max_bytes as u64, "one case", request)?;
    let mut share = memory.body(tenant, exact).await?;
    let mut held = Vec::with_capacity(exact.min(max_bytes));
    let read = async {
        while let Some(data) = reader.next().await? {
            if share.is_none() && held.len() + data.len() > SMALL_BYTES {
                share = memory.body(tenant, max_bytes).await?;
            }
            // A compressed body is decompressed without waiting for the client; other tasks run in between.
            if (held.len() + data.len()) / SMALL_BYTES > held.len() / SMALL_BYTES {
                tokio::task::yield_now().await;
            }
            held.extend_from_slice(&data);
        }
        Ok::<(), ApiError>(())
    };
    let read = tokio::time::timeout(within, read).await;
    read.map_err(|_| {
        let detail = format!("the body did not arrive within {} s", within.as_secs_f64());
        ApiError::new(ProblemKind::BodyTimeout, detail)
    })??;
    if let Some(share) = &mut share {
        share.shrink_to(held.len());
    }
    Ok((Bytes::from(held), share))
}

/// Most members of all objects together. The longest allowed list of motions has less than half of it.
pub const MEMBERS_MAX: usize = 200_000;

/// Bytes of an object: a node of its tree of members.
const OBJECT_BYTES: usize = 640;
/// Bytes of a member without its value: its name, and its share of further nodes.
const MEMBER_BYTES: usize = 112;
/// Bytes of the smallest array that is not empty.
const ARRAY_BYTES: usize = 4 * size_of::<Value>();

/// Size of a text once it is parsed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weight {
    /// Memory of the parsed value in bytes, an upper estimate.
    pub bytes: usize,
    /// Number of members of all objects.
    pub members: usize,
}

/// Estimates the memory of the parsed text; the text need not be valid JSON.
#[must_use]
pub fn weigh(text: &[u8]) -> Weight {
    let (mut values, mut arrays, mut objects, mut members) = (1_usize, 0_usize, 0_usize, 0_usize);
    let (mut in_string, mut escaped) = (false, false);
    for byte in text {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b',' => values += 1,
            b'[' => arrays += 1,
            b'{' => objects += 1,
            b':' => members += 1,
            _ => {}
        }
    }
    // Arrays grow by doubling.
    let values = 2 * (values + arrays + objects) * size_of::<Value>();
    Weight {
        bytes: text.len()
            + values
            + arrays * ARRAY_BYTES
            + objects * OBJECT_BYTES
            + members * MEMBER_BYTES,
        members,
    }
}

/// Lowest average rate of a body in bytes per second, after the time that one piece may take. Without it, a client could keep a connection
/// open for ever by sending single bytes.
const LOWEST_RATE: f64 = 1024.0;

/// Streams a body within limits of size and time.
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
    /// Creates the reader of the body of a request. `timeout` limits the time of a piece; `what` describes the body in errors.
    ///
    /// # Errors
    /// `body-too-large`: the declared length exceeds `max_bytes`.
    pub fn new(
        timeout: Duration,
        max_bytes: u64,
        what: &'static str,
        request: Request<Body>,
    ) -> Result<BodyReader> {
        let declared = declared_length(request.headers());
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

    /// Appends the rest of the body to `text`.
    ///
    /// # Errors
    /// See [`BodyReader::next`].
    pub async fn read_to_end(&mut self, text: &mut Vec<u8>) -> Result<()> {
        while let Some(piece) = self.next().await? {
            text.extend_from_slice(&piece);
        }
        Ok(())
    }

    /// Returns the next piece; `None` at the end.
    ///
    /// # Errors
    /// The body is too large, too slow, or ends early.
    pub async fn next(&mut self) -> Result<Option<Bytes>> {
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
                    "no part of the body arrived for {} s, or it arrived at less than {LOWEST_RATE} bytes per second",
                    self.timeout.as_secs_f64()
                ),
            )
        })?;
        let Some(piece) = piece else { return Ok(None) };
        let piece = piece.map_err(|error| match too_long(&error) {
            true => self.too_large(),
            false => unreadable(&error),
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

/// A part of `multipart/form-data` after the last allowed one.
#[derive(Debug, thiserror::Error)]
#[error(
    "the body has the part `{0}` after the table; allowed are one part `template` (the case, JSON) and one part `table`, in this order; \
         options are parameters of the query"
)]
pub struct UnexpectedPart(pub String);

/// Returns the error of a body that ended early, cannot be decompressed, or has a part that is not allowed.
pub fn unreadable(error: &(dyn std::error::Error + 'static)) -> ApiError {
    let mut deepest = error;
    while let Some(next) = deepest.source() {
        deepest = next;
    }
    if deepest.is::<UnexpectedPart>() {
        return ApiError::new(ProblemKind::FaultyTable, deepest.to_string());
    }
    ApiError::new(
        ProblemKind::UnreadableBody,
        format!("the body ended early or cannot be decompressed: {deepest}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn well_formed_json_is_read_as_it_stands() {
        let text = r#"{"b": [1, -2, 1.5e-300, null, true, "x\u00e4"], "a": {}}"#;
        let expected: Value = serde_json::from_str(text).unwrap();
        assert_eq!(read_json(text.as_bytes()).unwrap(), expected);
    }

    #[test]
    fn malformed_json_is_refused() {
        let deep = "[".repeat(200) + &"]".repeat(200);
        for text in [
            "",
            " ",
            "{",
            "NaN",
            "[1e999]",
            "{\"a\": 1} x",
            "{\"a\": 1, \"a\": 1}",
            "[{\"a\":{\"b\":1,\"b\":2}}]",
            &deep,
        ] {
            assert!(read_json(text.as_bytes()).is_err(), "{text:?} was accepted");
        }
        assert!(
            read_json(b"\"\xff\"").is_err(),
            "bytes that are not UTF-8 were accepted"
        );
    }

    #[test]
    fn texts_are_weighed_by_what_they_become() {
        let of = |text: &str| weigh(text.as_bytes());
        assert_eq!(of(r#"{"a":1,"b":[{"c":",:{[\""}]}"#).members, 3);
        assert!(of(r#"{"a":"[,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,"}"#).bytes < 2000);
        let bomb = format!("[{}]", vec![r#"{"":1}"#; 1000].join(","));
        assert!(of(&bomb).bytes > 1000 * (OBJECT_BYTES + size_of::<Value>()));
        let samples = format!("[{}]", vec!["0"; 1000].join(","));
        assert!((32_000..80_000).contains(&of(&samples).bytes));
    }
}
