//! CSV (RFC 4180): a header with the names, one line per row. Zones are words; what lies outside the patch is empty.

use std::borrow::Cow;
use std::fmt::Write;
use std::ops::Range;

use crate::http::render::table::{ArrayData, Precision, Rows, Table};

/// The line with the names.
///
/// # Errors
/// Never, as memory takes all that is written.
pub(crate) fn head(table: &Table) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let axes: &[&str] = match table.rows {
        Rows::Cells => &[],
        Rows::Grid { .. } => &["x_mm", "y_mm"],
    };
    let columns = table.columns.iter().map(|column| column.name);
    out.write_record(axes.iter().copied().chain(columns))?;
    finish(out)
}

/// Some lines. Numbers have as many digits as it takes to read the same number back.
///
/// # Errors
/// Never, as memory takes all that is written.
pub(crate) fn lines(table: &Table, rows: Range<usize>) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let written = |value: f64| number_as(value, table.precision);
    for row in rows {
        if let Rows::Grid { x_mm, y_mm } = &table.rows {
            out.write_field(written(x_mm[row % x_mm.len()]))?;
            out.write_field(written(y_mm[row / x_mm.len()]))?;
        }
        for column in &table.columns {
            match &column.data {
                ArrayData::Numbers(values) => out.write_field(written(values[row]))?,
                ArrayData::Integers(values) => out.write_field(values[row].to_string())?,
                ArrayData::Zones(zones) => {
                    out.write_field(zones[row].map_or("", |zone| zone.name()))?;
                }
            }
        }
        out.write_record(None::<&[u8]>)?;
    }
    finish(out)
}

/// A text of a client as a field of a table. Spreadsheets run a text that begins like a formula, even behind blanks, tabs or line breaks; a
/// leading apostrophe marks it as text. Numbers are written as they are.
#[must_use]
pub(crate) fn text_field(text: &str) -> Cow<'_, str> {
    let begin = text.trim_start_matches(|mark: char| mark.is_whitespace() || mark.is_control());
    // Spreadsheets take the wide forms for the same signs.
    let formula = begin.starts_with(['=', '+', '-', '@', '＝', '＋', '－', '＠']);
    match formula && !is_number(text) {
        true => Cow::Owned(format!("'{text}")),
        false => Cow::Borrowed(text),
    }
}

/// Digits with a sign, a point or a comma, and an exponent.
fn is_number(text: &str) -> bool {
    let digits = |mark: char| mark.is_ascii_digit() || "+-.,eE".contains(mark);
    let text = text.trim();
    text.chars().all(digits) && text.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// What was written.
///
/// # Errors
/// None that memory does not have.
pub(crate) fn finish(out: csv::Writer<Vec<u8>>) -> Result<Vec<u8>, csv::Error> {
    out.into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))
}

/// The shortest text that reads back as the same number; empty for NaN.
#[must_use]
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() {
        String::new()
    } else {
        format!("{value:?}")
    }
}

/// The same in this precision.
#[must_use]
pub(crate) fn number_as(value: f64, precision: Precision) -> String {
    match precision {
        Precision::Single if !value.is_nan() => format!("{:?}", single(value)),
        _ => number(value),
    }
}

/// The nearest number of 32 bits; NaN stays NaN.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "that is what is asked for")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// The shortest digits that are read as the same number.
pub(crate) fn write_number(text: &mut String, number: f64, none: &str) {
    if number.is_finite() {
        let _ = write!(text, "{number:?}");
    } else {
        text.push_str(none);
    }
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
        for value in [
            0.0,
            -0.0,
            0.1 + 0.2,
            1e-300,
            123_456_789.123_456_78,
            f64::MAX,
        ] {
            let text = number(value);
            assert!(text.len() < 26, "{text}");
            assert_eq!(
                text.parse::<f64>().unwrap().to_bits(),
                value.to_bits(),
                "{text}"
            );
        }
        assert_eq!(number(f64::NAN), "");
    }
}
