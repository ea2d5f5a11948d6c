//! Reads bodies: as they arrive, within limits of size and time, and as JSON that is declared as such and names no member twice.
use std::fmt;
use std::time::Duration;

use axum::body::{Body, BodyDataStream, Bytes, HttpBody};
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, header};
use futures_util::StreamExt;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use tokio::time::{Instant, timeout_at};

use crate::extract::caller::Tenant;
use crate::layers::admission::{PackedLength, too_long};
use crate::limits::{Memory, MemoryPermit, Permit, SMALL_BYTES};
use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result};
use crate::state::AppState;
use railhead_jobs::sync::blocking;

/// The JSON body of a request. What it means is for others to judge.
#[derive(Debug)]
pub struct JsonBody {
    /// What was sent.
    pub value: Value,
    /// The memory that it takes, and the turn of a large one; to be held until it has been checked.
    pub room: MemoryPermit,
}

impl FromRequest<AppState> for JsonBody {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &AppState) -> Result<Self> {
        let AppState {
            options, memory, ..
        } = state;
        require_json(request.headers())?;
        let tenant = request.extensions().get::<Tenant>().cloned();
        let Tenant(tenant) = tenant.unwrap_or_else(|| Tenant("".into()));
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
        // Off the threads that answer requests, few at a time.
        let turn = memory.turn(&tenant, weight).await?;
        let room = MemoryPermit {
            share,
            turn: Some(turn),
        };
        let read = blocking(move || {
            let value = read_json(&bytes);
            drop((bytes, held));
            // The memory is held until the work ends, even if the client has gone away.
            value.map(|value| JsonBody { value, room })
        });
        read.await?
    }
}

/// The weight of a case; counting in a large one takes long enough that it must not hold up other requests.
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

/// What the text of a case will take in memory once it is parsed.
///
/// # Errors
/// `body-too-large`: more than one case may take.
pub fn weigh_case(text: &[u8], max_bytes: usize) -> Result<usize> {
    let weight = weigh(text);
    if weight.bytes > max_bytes {
        return Err(ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "the case would take about {} bytes in memory; allowed: {max_bytes}",
                weight.bytes
            ),
        ));
    }
    if weight.members > MEMBERS_MAX {
        return Err(ApiError::new(
            ProblemKind::BodyTooLarge,
            format!(
                "the objects of the case have {} members; allowed: {MEMBERS_MAX}",
                weight.members
            ),
        ));
    }
    Ok(weight.bytes)
}

/// Parses JSON text (RFC 8259) without repairing anything: a member written twice and a number beyond the range of
/// `f64` are refused, like every other error, with line and column.
///
/// # Errors
/// `malformed-json` with its position.
pub fn read_json(text: &[u8]) -> Result<Value> {
    read_strict(text).map_err(|error| not_json(unlike_json(text), &error))
}

/// The refusal of a body that is not JSON, with what is wrong with its beginning, if anything is.
#[must_use]
pub fn not_json(unlike: Option<&str>, error: &serde_json::Error) -> ApiError {
    let refusal = ApiError::malformed(error);
    match unlike {
        Some(reason) => refusal.saying(format!("the body is not JSON: {reason}")),
        None => refusal,
    }
}

/// What is wrong with a text that does not even begin like JSON.
#[must_use]
pub fn unlike_json(text: &[u8]) -> Option<&'static str> {
    match text {
        [0xef, 0xbb, 0xbf, ..] => Some("it begins with a byte order mark; send UTF-8 without one"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("it is UTF-16; send UTF-8"),
        _ if text.iter().all(u8::is_ascii_whitespace) => Some("it is empty"),
        _ => None,
    }
}

/// As [`read_json`], with the parser's own error.
///
/// # Errors
/// The text is not JSON.
pub fn read_strict(text: &[u8]) -> Result<Value, serde_json::Error> {
    serde_json::from_slice::<Strict>(text).map(|Strict(value)| value)
}

/// The media type of a body without its parameters, in small letters; empty if none is given.
#[must_use]
pub fn essence(headers: &HeaderMap) -> String {
    let given = headers.get(header::CONTENT_TYPE);
    let text = given.map_or("", |value| value.to_str().unwrap_or("?"));
    let essence = text.split(';').next().unwrap_or_default();
    essence.trim().to_ascii_lowercase()
}

/// Refuses a content type that names another charset than UTF-8.
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
    let given = headers
        .get(header::CONTENT_TYPE)
        .map(|value| value.to_str().unwrap_or("?"));
    let subtype = essence(headers);
    if subtype == "application/json"
        || (subtype.starts_with("application/") && subtype.ends_with("+json"))
    {
        return Ok(());
    }
    let given = given.map_or("no content type was given".to_owned(), |value| {
        format!("`{value}` was given")
    });
    Err(ApiError::new(
        ProblemKind::UnsupportedMediaType,
        format!("{given}; send the case with `Content-Type: application/json`"),
    ))
}

/// The whole body, and the share of memory that it takes. Memory is taken before anything is read: the declared length,
/// or where it is not known, as that of a packed body, as much as a body may have once it turns out not to be small.
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
            // A packed body is there at once and unpacks for a while: others get their turn in between.
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

/// A JSON value in which no object names a member twice; `Value` itself would keep the last one silently.
pub struct Strict(pub Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Strict)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value.into()))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        let number = Number::from_f64(value).ok_or_else(|| E::custom("number out of range"))?;
        Ok(Value::Number(number))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(Value::String(value.to_owned()))
    }

    fn visit_string<E>(self, value: String) -> Result<Value, E> {
        Ok(Value::String(value))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(Strict(item)) = items.next_element()? {
            array.push(item);
        }
        Ok(Value::Array(array))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(name) = members.next_key::<String>()? {
            if object.contains_key(&name) {
                return Err(A::Error::custom(format_args!(
                    "the member `{name}` is written twice"
                )));
            }
            let Strict(value) = members.next_value()?;
            object.insert(name, value);
        }
        Ok(Value::Object(object))
    }
}

/// Most members of all objects together. The longest list of motions has less than half as many.
pub const MEMBERS_MAX: usize = 200_000;

/// A node of the tree that holds an object's members takes this much, also if there is only one of them.
const OBJECT_BYTES: usize = 640;
/// What a member takes besides its value: the text of its name, and its part of further nodes.
const MEMBER_BYTES: usize = 112;
/// The smallest array that is not empty.
const ARRAY_BYTES: usize = 4 * size_of::<Value>();

/// What a text holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weight {
    /// Memory of the parsed value in bytes, rather too much than too little.
    pub bytes: usize,
    /// Members of all objects.
    pub members: usize,
}

/// Weighs a text, be it JSON or not.
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
    ) -> Result<BodyReader> {
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

/// A part of `multipart/form-data` after the last one that is allowed.
#[derive(Debug, thiserror::Error)]
#[error(
    "the body has the part `{0}` after the table; allowed are one part `template` (the case, JSON) and one part `table`, in this order; \
         options are parameters of the query"
)]
pub struct UnexpectedPart(pub String);

/// A body that broke off, could not be unpacked, or has a part that is not allowed.
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
