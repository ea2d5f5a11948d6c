//! Writes CSV (RFC 4180): a line of names, then a line per row.

use std::borrow::Cow;
use std::fmt::Write;
use std::ops::Range;

use serde::Serialize;
use utoipa::ToSchema;

/// Precision of written numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 64 bits.
    #[default]
    Double,
    /// 32 bits, about seven digits, which are enough for pictures.
    Single,
}

/// Returns the line with the names of the columns.
///
/// # Errors
/// Never, because writing to memory does not fail.
pub fn head<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(names.into_iter().map(|name| text_field(name).into_owned()))?;
    finish(out)
}

/// Returns the lines of these rows; `write` appends the field of a column and a row.
///
/// # Errors
/// Never, because writing to memory does not fail.
pub fn lines(
    columns: usize,
    rows: Range<usize>,
    write: impl Fn(&mut String, usize, usize),
) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::with_capacity(16 * rows.len() * columns));
    let mut field = String::new();
    for row in rows {
        for column in 0..columns {
            field.clear();
            write(&mut field, column, row);
            out.write_field(&field)?;
        }
        out.write_record(None::<&[u8]>)?;
    }
    finish(out)
}

/// Returns a text of a client as a field. Spreadsheets evaluate a text that begins like a formula, even after white space; a leading
/// apostrophe marks it as text. Numbers are not marked.
#[must_use]
pub fn text_field(text: &str) -> Cow<'_, str> {
    let begin = text.trim_start_matches(|mark: char| mark.is_whitespace() || mark.is_control());
    // Spreadsheets accept full-width forms of these characters.
    let formula = begin.starts_with(['=', '+', '-', '@', '＝', '＋', '－', '＠']);
    match formula && !is_number(text) {
        true => Cow::Owned(format!("'{text}")),
        false => Cow::Borrowed(text),
    }
}

/// Whether a text is a number with a decimal point or comma.
fn is_number(text: &str) -> bool {
    let digits = |mark: char| mark.is_ascii_digit() || "+-.,eE".contains(mark);
    let text = text.trim();
    text.chars().all(digits) && text.replacen(',', ".", 1).parse::<f64>().is_ok()
}

fn finish(out: csv::Writer<Vec<u8>>) -> Result<Vec<u8>, csv::Error> {
    out.into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))
}

/// Returns the nearest 32-bit number; NaN for NaN.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "rounding is intended")]
pub fn single(value: f64) -> f32 {
    value as f32
}

/// Appends the shortest digits that parse to the same number, or `none` for a number that is not finite.
pub fn write_number(text: &mut String, number: f64, precision: Precision, none: &str) {
    // Writing to a string does not fail.
    let _ = match precision {
        _ if !number.is_finite() => write!(text, "{none}"),
        Precision::Double => write!(text, "{number:?}"),
        Precision::Single => write!(text, "{:?}", single(number)),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_that_begin_like_formulas_are_marked_and_numbers_are_not() {
        for text in [
            "=1+1", "+1+1", "-1-1", "@SUM(1)", " =1", "\t=1", "\r@a", "-", "-a", "+inf", "-nan",
            "－1", "=5", "- 5", "-5;1", "-1,2,3", "\u{a0}=1",
        ] {
            assert_eq!(text_field(text), format!("'{text}"));
        }
        for text in [
            "-5", "+5", "-5.25", "-5,25", "-1e-3", "+.5", "", "a=1", "1-1", "'=1", "é",
        ] {
            assert_eq!(text_field(text), text);
        }
    }

    #[test]
    fn numbers_read_back_as_they_were() {
        let text = |value| {
            let mut text = String::new();
            write_number(&mut text, value, Precision::Double, "");
            text
        };
        for value in [
            0.0,
            -0.0,
            0.1 + 0.2,
            1e-300,
            123_456_789.123_456_78,
            f64::MAX,
        ] {
            let text = text(value);
            assert!(text.len() < 26, "{text}");
            assert_eq!(
                text.parse::<f64>().unwrap().to_bits(),
                value.to_bits(),
                "{text}"
            );
        }
        assert_eq!(text(f64::NAN), "");
    }
}
