//! Reads a JSON body: declared as JSON, not too large, well-formed, no member written twice.

use std::fmt;

use axum::body::{Bytes, HttpBody};
use axum::extract::{FromRef, FromRequest, Request};
use axum::http::{HeaderMap, header};
use http_body_util::{BodyExt, Limited};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use crate::http::extract::body_reader::unreadable;
use crate::http::extract::caller::Tenant;
use crate::http::extract::json_weight::{MEMBERS_MAX, weigh};
use crate::http::layers::admission::too_long;
use crate::http::limits::memory::{Memory, MemoryPermit, SMALL_BYTES};
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::sync::blocking;

/// The JSON body of a request. What it means is for others to judge.
#[derive(Debug)]
pub struct JsonBody {
    /// What was sent.
    pub value: Value,
    /// The memory that it takes, and the turn of a large one; to be held until it has been checked.
    pub room: MemoryPermit,
}

impl<S> FromRequest<S> for JsonBody
where
    S: Send + Sync,
    HttpOptions: FromRef<S>,
    Memory: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> Result<Self, ApiError> {
        let options = HttpOptions::from_ref(state);
        let memory = Memory::from_ref(state);
        require_json(request.headers())?;
        let tenant = request.extensions().get::<Tenant>().cloned();
        let Tenant(tenant) = tenant.unwrap_or_else(|| Tenant("".into()));
        let (bytes, held) = read_whole(request, &memory, &tenant, &options).await?;
        let weight = weigh_in_turn(&memory, &tenant, &bytes, options.parsed_max_bytes).await?;
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
) -> Result<usize, ApiError> {
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
pub fn weigh_case(text: &[u8], max_bytes: usize) -> Result<usize, ApiError> {
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
pub fn read_json(text: &[u8]) -> Result<Value, ApiError> {
    read_strict(text).map_err(|error| {
        let refusal = ApiError::malformed(&error);
        match unlike_json(text) {
            Some(reason) => refusal.saying(format!("the body is not JSON: {reason}")),
            None => refusal,
        }
    })
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

fn require_json(headers: &HeaderMap) -> Result<(), ApiError> {
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
) -> Result<(Bytes, Option<Permit>), ApiError> {
    let max_bytes = options.body_max_bytes;
    let too_large = || {
        ApiError::new(
            ProblemKind::BodyTooLarge,
            format!("the body is larger than the {max_bytes} bytes that are allowed for one case"),
        )
    };
    // A declared length is judged before anything is read.
    let declared = request.headers().get(header::CONTENT_LENGTH);
    let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if declared.is_some_and(|length| length > max_bytes as u64) {
        return Err(too_large());
    }
    let exact = request.body().size_hint().exact();
    let exact = exact.and_then(|bytes| usize::try_from(bytes).ok());
    let mut share = memory.body(tenant, exact.unwrap_or(0)).await?;
    let mut body = Limited::new(request.into_body(), max_bytes);
    let mut held = Vec::with_capacity(exact.unwrap_or(0).min(max_bytes));
    let read = async {
        while let Some(frame) = body.frame().await {
            let frame = frame.map_err(|error| {
                if too_long(error.as_ref()) {
                    too_large()
                } else {
                    unreadable(error.as_ref())
                }
            })?;
            let Ok(data) = frame.into_data() else {
                continue;
            };
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
    match tokio::time::timeout(options.body_timeout, read).await {
        Ok(read) => read?,
        Err(_) => {
            return Err(ApiError::new(
                ProblemKind::BodyTimeout,
                format!(
                    "the body did not arrive within {} s",
                    options.body_timeout.as_secs_f64()
                ),
            ));
        }
    }
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
}
