//! Reads a JSON body: declared as JSON, not too large, well-formed, no member written twice.

use std::fmt;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::{FromRef, FromRequest, Request};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use crate::http::HttpOptions;
use crate::http::coding::too_long;
use crate::http::error::{ApiError, Kind};

/// The JSON body of a request. What it means is for others to judge.
#[derive(Debug)]
pub struct JsonBody(pub Value);

impl<S> FromRequest<S> for JsonBody
where
    S: Send + Sync,
    HttpOptions: FromRef<S>,
{
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> Result<Self, ApiError> {
        let options = HttpOptions::from_ref(state);
        require_json(request.headers())?;
        let bytes =
            read_whole(request, state, options.body_timeout, options.body_max_bytes).await?;
        read_json(&bytes).map(JsonBody)
    }
}

/// Parses JSON text (RFC 8259) without repairing anything: a member written twice and a number beyond the range of
/// `f64` are refused, like every other error, with line and column.
///
/// # Errors
/// `malformed-json` with its position.
pub fn read_json(text: &[u8]) -> Result<Value, ApiError> {
    read_strict(text).map_err(|error| ApiError::malformed(&error))
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
        Kind::UnsupportedMediaType,
        format!("{given}; send the case with `Content-Type: application/json`"),
    ))
}

async fn read_whole<S: Send + Sync>(
    request: Request,
    state: &S,
    timeout: Duration,
    max_bytes: usize,
) -> Result<Bytes, ApiError> {
    let too_large = || {
        ApiError::new(
            Kind::BodyTooLarge,
            format!("the body is larger than the {max_bytes} bytes that are allowed for one case"),
        )
    };
    // A declared length is judged before anything is read.
    let declared = request.headers().get(header::CONTENT_LENGTH);
    let declared = declared.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if declared.is_some_and(|length| length > max_bytes as u64) {
        return Err(too_large());
    }
    match tokio::time::timeout(timeout, Bytes::from_request(request, state)).await {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(rejection)) if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE => {
            Err(too_large())
        }
        Ok(Err(rejection)) if too_long(&rejection) => Err(too_large()),
        Ok(Err(rejection)) => Err(ApiError::new(Kind::UnreadableBody, rejection.body_text())),
        Err(_) => Err(ApiError::new(
            Kind::BodyTimeout,
            format!("the body did not arrive within {} s", timeout.as_secs_f64()),
        )),
    }
}

/// A JSON value in which no object names a member twice; `Value` itself would keep the last one silently.
struct Strict(Value);

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
