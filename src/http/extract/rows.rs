//! Reads rows in JSON: a template case and columns of numbers or texts, straight into columns.

use std::collections::HashSet;
use std::fmt;

use axum::body::Bytes;
use axum::extract::Request;
use axum::http::header;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

use crate::contact::evaluate::varied::Values;
use crate::http::extract::body_reader::BodyReader;
use crate::http::extract::json::Strict;
use crate::http::extract::titles::require_few;
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::jobs::codec::table::COLUMNS_MAX;

/// The bytes that a request's body may have, or has as far as it says.
#[must_use]
pub fn declared_bytes(request: &Request, options: &HttpOptions) -> usize {
    let length = request.headers().get(header::CONTENT_LENGTH);
    let length = length.and_then(|value| value.to_str().ok()?.parse().ok());
    let packed = request.headers().contains_key(header::CONTENT_ENCODING);
    length
        .filter(|_| !packed)
        .unwrap_or(options.evaluate_max_bytes)
}

/// The whole body. It may take long as long as it keeps to the lowest rate of large bodies.
///
/// # Errors
/// It is too large, too slow, or breaks off.
pub async fn read_body(request: Request, options: &HttpOptions) -> Result<Bytes, ApiError> {
    let max_bytes = options.evaluate_max_bytes;
    let declared = declared_bytes(&request, options);
    let mut reader = BodyReader::new(
        options.body_timeout,
        max_bytes as u64,
        "rows (`--evaluate-max-mib`)",
        request,
    )?;
    // A body that does not say its length grows.
    let mut text = Vec::with_capacity(if declared < max_bytes { declared } else { 0 });
    while let Some(piece) = reader.next().await? {
        text.extend_from_slice(&piece);
    }
    Ok(text.into())
}

/// A template and columns of numbers or texts from JSON, `{"template": …, "columns": {"<JSON pointer>": […], …}}`.
///
/// # Errors
/// `malformed-json` with its position, and with column and row where the fault is in a column.
pub fn read_json_columns(text: &[u8]) -> Result<(Value, NamedValues), ApiError> {
    let read: RowsBody =
        serde_json::from_slice(text).map_err(|error| ApiError::malformed(&error))?;
    require_few(read.columns.count)?;
    Ok((read.template.0, read.columns.columns))
}

/// Columns with their names.
pub type NamedValues = Vec<(String, Values)>;

/// The JSON body of rows.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowsBody {
    template: Strict,
    columns: RowColumns,
}

/// Columns; of those beyond [`COLUMNS_MAX`] only the count is kept.
#[derive(Default)]
struct RowColumns {
    columns: NamedValues,
    count: usize,
}

impl<'de> Deserialize<'de> for RowColumns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(RowColumnsVisitor)
    }
}

struct RowColumnsVisitor;

impl<'de> Visitor<'de> for RowColumnsVisitor {
    type Value = RowColumns;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object of columns, each named by a JSON pointer into the case")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<RowColumns, A::Error> {
        let (mut read, mut seen) = (RowColumns::default(), HashSet::new());
        while let Some(pointer) = members.next_key::<String>()? {
            read.count += 1;
            if read.count > COLUMNS_MAX {
                members.next_value::<IgnoredAny>()?;
                continue;
            }
            if !seen.insert(pointer.clone()) {
                return Err(A::Error::custom(format_args!(
                    "the column `{pointer}` is written twice"
                )));
            }
            let values = members.next_value_seed(RowValues(&pointer))?;
            read.columns.push((pointer, values));
        }
        Ok(read)
    }
}

/// Reads the values of a column: numbers, or texts if the first is one.
struct RowValues<'a>(&'a str);

impl<'de> DeserializeSeed<'de> for RowValues<'_> {
    type Value = Values;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Values, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for RowValues<'_> {
    type Value = Values;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "an array of numbers in the column `{}`", self.0)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Values, A::Error> {
        let first = items.next_element::<First>();
        match first.map_err(|error| self.at(0, &error))? {
            None => Ok(Values::Numbers(Vec::new())),
            Some(First::Number(first)) => self.rest(items, first).map(Values::Numbers),
            Some(First::Text(first)) => {
                let texts = self.rest::<_, String>(items, first)?;
                Ok(Values::Texts(texts.into_iter().map(Some).collect()))
            }
        }
    }
}

impl RowValues<'_> {
    fn rest<'de, A: SeqAccess<'de>, T: Deserialize<'de>>(
        &self,
        mut items: A,
        first: T,
    ) -> Result<Vec<T>, A::Error> {
        let mut values = vec![first];
        loop {
            match items.next_element::<T>() {
                Ok(Some(value)) => values.push(value),
                Ok(None) => return Ok(values),
                Err(error) => return Err(self.at(values.len(), &error)),
            }
        }
    }

    fn at<E: Error>(&self, row: usize, error: &E) -> E {
        E::custom(format_args!("column `{}`, row {row}: {error}", self.0))
    }
}

/// The first value of a column, which decides what it holds.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number or a text")]
enum First {
    Number(f64),
    Text(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_name_row_and_column() {
        let text = |error: ApiError| format!("{error:?}");
        let null = br#"{"template":{},"columns":{"/motion/creepage_x":[0.1,null]}}"#;
        let fault = text(read_json_columns(null).unwrap_err());
        assert!(
            fault.contains("/motion/creepage_x") && fault.contains("row 1"),
            "{fault}"
        );
    }
}
