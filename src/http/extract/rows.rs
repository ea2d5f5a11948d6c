//! Reads rows: a template case and columns of numbers, as JSON or CSV, straight into columns.

use std::collections::HashSet;
use std::fmt;
use std::io::Cursor;

use axum::body::Bytes;
use axum::extract::Request;
use axum::http::header;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor,
};
use serde_json::Value;

use crate::contact::evaluate::column::Column;
use crate::contact::evaluate::varied::Values;
use crate::http::extract::arriving::Arriving;
use crate::http::extract::json::Strict;
use crate::http::extract::titles::{
    Place, delimiter, faulty, is_line_of_units, number, places, require_few,
};
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::jobs::codec::arrow;
use crate::jobs::codec::table::{COLUMNS_MAX, TableColumn};
use crate::jobs::run::head::converted;

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
    let mut arriving = Arriving::new(
        options.body_timeout,
        max_bytes as u64,
        "rows (`--evaluate-max-mib`)",
        request,
    )?;
    // A body that does not say its length grows.
    let mut text = Vec::with_capacity(if declared < max_bytes { declared } else { 0 });
    while let Some(piece) = arriving.next().await? {
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
    Ok((read.template, read.columns.columns))
}

/// Columns with their names.
pub type NamedValues = Vec<(String, Values)>;

/// Columns from CSV, whose first line names them as a table of a batch does; the second line may give their units.
///
/// # Errors
/// `faulty-table` with line and column.
pub fn read_csv(text: &[u8]) -> Result<Vec<Column>, ApiError> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let end = text
        .iter()
        .position(|byte| *byte == b'\n')
        .unwrap_or(text.len());
    let delimiter = delimiter(&text[..end]);
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .from_reader(text);
    let unread = |error: csv::Error| faulty(format!("the table cannot be read: {error}"));
    let mut record = csv::StringRecord::new();
    reader.read_record(&mut record).map_err(unread)?;
    require_few(record.len())?;
    let titles: Vec<String> = record.iter().map(|title| title.trim().to_owned()).collect();
    let mut record = csv::ByteRecord::new();
    let mut more = reader.read_byte_record(&mut record).map_err(unread)?;
    let units: Vec<String> = record.iter().map(|unit| field(unit).to_owned()).collect();
    let units = Some(units)
        .filter(|units| more && units.len() == titles.len())
        .filter(|units| is_line_of_units(units.iter().map(String::as_str)));
    if units.is_some() {
        more = reader.read_byte_record(&mut record).map_err(unread)?;
    }
    let unit = |place: usize| units.as_ref().map(|units| units[place].as_str());
    let named = titles.iter().enumerate();
    let named = places(named.map(|(place, title)| (title.as_str(), unit(place))));
    let named = named.map_err(|error| {
        let detail = format!("line 1: {}", error.detail());
        error.saying(detail)
    })?;
    let mut columns = vec![Vec::new(); named.len()];
    while more {
        let line = || {
            let start = record.position().map_or(0, csv::Position::byte);
            line_at(text, usize::try_from(start).unwrap_or(0))
        };
        if record.len() != columns.len() {
            let detail = format!(
                "line {} has {} fields, the header has {}",
                line(),
                record.len(),
                columns.len()
            );
            return Err(faulty(detail));
        }
        for (place, (text, values)) in record.iter().zip(&mut columns).enumerate() {
            let text = field(text);
            match number(text, delimiter != b',') {
                Some(number) if number.is_finite() => values.push(number),
                _ => {
                    let detail = format!(
                        "line {}, column `{}`: `{text}` is not a number",
                        line(),
                        named[place].pointer
                    );
                    return Err(faulty(detail));
                }
            }
        }
        more = reader.read_byte_record(&mut record).map_err(unread)?;
    }
    Ok(named.into_iter().zip(columns).map(column).collect())
}

fn field(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap_or("?").trim()
}

/// A column from its place and the numbers that were sent.
#[must_use]
pub fn column((place, mut values): (Place, Vec<f64>)) -> Column {
    if place.factor != 1.0 {
        for value in &mut values {
            *value = converted(*value, place.factor);
        }
    }
    Column {
        pointer: place.pointer,
        values,
    }
}

/// Columns from an Arrow stream or file, named as those of CSV are.
///
/// # Errors
/// `faulty-table` with the column.
pub fn read_arrow(data: Bytes) -> Result<Vec<Column>, ApiError> {
    let unread =
        |error: &dyn fmt::Display| faulty(format!("the Arrow data cannot be read: {error}"));
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let mut named = Vec::new();
    for table in arrow::read(Cursor::new(data)).map_err(|error| unread(&error))? {
        let table = table.map_err(|error| unread(&error))?;
        if columns.is_empty() {
            let titles = table.columns.iter().map(|(title, _)| (&**title, None));
            named = places(titles)?;
            let empty = |(title, _): &(String, TableColumn)| (title.clone(), Vec::new());
            columns = table.columns.iter().map(empty).collect();
        }
        for ((title, held), (_, values)) in columns.iter_mut().zip(table.columns) {
            let numbers = match values {
                TableColumn::Numbers(numbers) => numbers,
                #[expect(clippy::cast_precision_loss, reason = "as every number of a case")]
                TableColumn::Integers(values) => values.iter().map(|value| *value as f64).collect(),
                TableColumn::Texts(_) => {
                    let detail = format!("column `{title}` holds texts; numbers are needed");
                    return Err(faulty(detail));
                }
            };
            if let Some(row) = numbers.iter().position(|number| !number.is_finite()) {
                let row = row + held.len();
                return Err(faulty(format!("column `{title}`, row {row}: no number")));
            }
            held.extend(numbers);
        }
    }
    let values = columns.into_iter().map(|(_, values)| values);
    Ok(named.into_iter().zip(values).map(column).collect())
}

/// Number of the line that a record begins on which follows this place, from 1; the reader's own place lies before the end of the line before.
fn line_at(text: &[u8], place: usize) -> usize {
    let ends = text[place..]
        .iter()
        .take_while(|byte| matches!(byte, b'\n' | b'\r'));
    let begin = place + ends.count();
    1 + text[..begin].iter().filter(|byte| **byte == b'\n').count()
}

/// The JSON body of rows.
struct RowsBody {
    template: Value,
    columns: RowColumns,
}

impl<'de> Deserialize<'de> for RowsBody {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(BodyVisitor)
    }
}

struct BodyVisitor;

impl<'de> Visitor<'de> for BodyVisitor {
    type Value = RowsBody;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object with `template` and `columns`")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<RowsBody, A::Error> {
        let (mut template, mut columns) = (None, None);
        while let Some(name) = members.next_key::<String>()? {
            let twice = match name.as_str() {
                "template" => {
                    let Strict(value) = members.next_value()?;
                    template.replace(value).is_some()
                }
                "columns" => columns
                    .replace(members.next_value::<RowColumns>()?)
                    .is_some(),
                _ => {
                    let known = "allowed: `template`, `columns`";
                    return Err(A::Error::custom(format_args!(
                        "`{name}` is not known here; {known}"
                    )));
                }
            };
            if twice {
                return Err(A::Error::custom(format_args!(
                    "the member `{name}` is written twice"
                )));
            }
        }
        Ok(RowsBody {
            template: template.ok_or_else(|| A::Error::missing_field("template"))?,
            columns: columns.ok_or_else(|| A::Error::missing_field("columns"))?,
        })
    }
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
enum First {
    Number(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for First {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<First, D::Error> {
        deserializer.deserialize_any(FirstVisitor)
    }
}

struct FirstVisitor;

impl Visitor<'_> for FirstVisitor {
    type Value = First;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number or a text")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<First, E> {
        Ok(First::Number(number))
    }

    #[expect(clippy::cast_precision_loss, reason = "as every number of JSON")]
    fn visit_i64<E: Error>(self, number: i64) -> Result<First, E> {
        Ok(First::Number(number as f64))
    }

    #[expect(clippy::cast_precision_loss, reason = "as every number of JSON")]
    fn visit_u64<E: Error>(self, number: u64) -> Result<First, E> {
        Ok(First::Number(number as f64))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<First, E> {
        Ok(First::Text(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_and_csv_of_the_same_rows_are_the_same_columns() {
        let json = br#"{"columns":{"/motion/creepage_x":[0.1,-2e-3],"/load/normal_force_n":[8e4,9]},"template":{"a":1}}"#;
        let (template, columns) = read_json_columns(json).unwrap();
        assert_eq!(template, serde_json::json!({ "a": 1 }));
        let columns = columns.into_iter();
        let columns: Vec<Column> = columns
            .map(|(pointer, values)| match values {
                Values::Numbers(values) => Column { pointer, values },
                Values::Texts(_) => unreachable!("numbers"),
            })
            .collect();
        let csv = "\u{feff}creepage_x, /load/normal_force_n\r\n0.1,80000\r\n-2e-3, 9 \r\n";
        assert_eq!(read_csv(csv.as_bytes()).unwrap(), columns);
        let units = "creepage_x;Normal force\n[%];[kN]\n10;80\n-0,2;0,009\n";
        assert_eq!(read_csv(units.as_bytes()).unwrap(), columns);
    }

    #[test]
    fn faults_name_row_and_column() {
        let text = |error: ApiError| format!("{error:?}");
        let null = br#"{"template":{},"columns":{"/motion/creepage_x":[0.1,null]}}"#;
        let fault = text(read_json_columns(null).unwrap_err());
        assert!(
            fault.contains("/motion/creepage_x") && fault.contains("row 1"),
            "{fault}"
        );
        let twice = format!("{:?}", read_csv(b"creepage_x,nu_x [-]\n1,2\n").unwrap_err());
        assert!(twice.contains("twice"), "{twice}");
        for (csv, words) in [
            ("creepage_x\n0.1\nx\n", ["line 3", "creepage_x"]),
            ("creepage_x\n0.1\nnan\n", ["line 3", "nan"]),
            ("creepage_x\r\n0.1\r\n\r\nx\r\n", ["line 4", "creepage_x"]),
            ("creepage_x,spin_per_mm\n0.1\n", ["line 2", "2"]),
            ("speed\n1\n", ["line 1", "speed"]),
        ] {
            let fault = text(read_csv(csv.as_bytes()).unwrap_err());
            assert!(
                words.iter().all(|word| fault.contains(word)),
                "{csv:?}: {fault}"
            );
        }
    }
}
