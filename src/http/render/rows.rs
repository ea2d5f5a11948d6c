//! Answers to rows as JSON columns and as tables, piece by piece as the client takes them.

use std::convert::Infallible;
use std::fmt::Write;
use std::ops::Range;

use axum::body::Body;

use crate::contact::evaluate::answer::RowsAnswer;
use crate::http::render::csv::write_number;
use crate::http::render::format::Format;
use crate::http::render::pieces::body;
use crate::http::render::row_tables::{RowWriter, WriteError};
use crate::jobs::codec::table::{RowTable, TableColumn, TableKind};

/// Rows written at once.
const ROWS: usize = 1024;

/// Rows of a batch of Arrow records, or of a group of a Parquet file.
const BATCH_ROWS: usize = 1 << 15;

/// A part of the JSON text.
enum RowsPart {
    Text(String),
    /// Numbers of the column at this place.
    Numbers(usize, Range<usize>),
    Status(Range<usize>),
}

/// `{"rows": …, "columns": {"force_x_n": […], …, "status": […]}}`; null where a row has no number.
pub(crate) fn json_body(answer: RowsAnswer) -> Body {
    let rows = answer.status.len();
    let mut parts = vec![RowsPart::Text(format!("{{\"rows\":{rows},\"columns\":{{"))];
    for (place, (name, _)) in answer.columns().iter().enumerate() {
        let before = if place == 0 { "" } else { "]," };
        parts.push(RowsPart::Text(format!("{before}\"{name}\":[")));
        parts.extend(ranges(rows).map(|range| RowsPart::Numbers(place, range)));
    }
    parts.push(RowsPart::Text("],\"status\":[".to_owned()));
    parts.extend(ranges(rows).map(RowsPart::Status));
    parts.push(RowsPart::Text("]}}".to_owned()));
    body(parts.into_iter().map(move |part| {
        let text = match part {
            RowsPart::Text(text) => text,
            RowsPart::Numbers(place, range) => numbers(answer.columns()[place].1, range),
            RowsPart::Status(range) => statuses(&answer, range),
        };
        Ok::<_, Infallible>(text.into_bytes())
    }))
}

/// The columns as a table.
///
/// # Errors
/// It cannot be begun.
pub(crate) fn table_body(format: Format, answer: RowsAnswer) -> Result<Body, WriteError> {
    let columns = answer.columns().into_iter();
    let columns: Vec<_> = columns
        .map(|(name, _)| (name.to_owned(), TableKind::Numbers))
        .chain([("status".to_owned(), TableKind::Texts)])
        .collect();
    let rows = answer.status.len();
    let step = match format {
        Format::Arrow | Format::Parquet => BATCH_ROWS,
        _ => ROWS,
    };
    let mut writer = RowWriter::new(format, &columns)?;
    let head = writer.head()?;
    let starts = (0..rows).step_by(step).map(Some).chain([None]);
    let pieces = starts.map(move |start| {
        let written = match start {
            Some(start) => writer.write(part(&answer, start..(start + step).min(rows))),
            None => writer.finish(),
        };
        written.map_err(std::io::Error::other)
    });
    Ok(body(std::iter::once(Ok(head)).chain(pieces)))
}

fn part(answer: &RowsAnswer, range: Range<usize>) -> RowTable {
    let status = answer.status[range.clone()].iter();
    let status = status
        .map(|status| Some(status.name().to_owned()))
        .collect();
    let numbers = answer.columns().into_iter();
    let numbers = numbers.map(|(name, column)| {
        let column = TableColumn::Numbers(column[range.clone()].to_vec());
        (name.to_owned(), column)
    });
    RowTable {
        columns: numbers
            .chain([("status".to_owned(), TableColumn::Texts(status))])
            .collect(),
    }
}

fn ranges(count: usize) -> impl Iterator<Item = Range<usize>> {
    let starts = (0..count).step_by(ROWS);
    starts.map(move |start| start..(start + ROWS).min(count))
}

fn numbers(column: &[f64], range: Range<usize>) -> String {
    let mut text = String::with_capacity(24 * range.len());
    for row in range {
        if row > 0 {
            text.push(',');
        }
        write_number(&mut text, column[row], "null");
    }
    text
}

fn statuses(answer: &RowsAnswer, range: Range<usize>) -> String {
    let mut text = String::with_capacity(16 * range.len());
    for row in range {
        let comma = if row > 0 { "," } else { "" };
        // Writing to a string does not fail.
        let _ = write!(text, "{comma}\"{}\"", answer.status[row].name());
    }
    text
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;
    use serde_json::{Value, json};

    use super::*;
    use crate::contact::evaluate::answer::RowStatus;

    fn answer(rows: usize) -> RowsAnswer {
        let column = |scale: f64| (0..rows).map(|k| scale * k as f64).collect();
        let mut numbers: Vec<(&'static str, Vec<f64>)> = vec![
            ("force_x_n", column(0.1)),
            ("force_y_n", column(-1e-9)),
            ("moment_z_n_mm", column(1e12)),
            ("error_estimate", column(3.0)),
            ("friction_power_n", column(0.0)),
            ("stick_share", column(1.0)),
        ];
        numbers[5].1[1] = f64::NAN;
        let mut answer = RowsAnswer {
            numbers,
            status: vec![RowStatus::Ok; rows],
        };
        answer.status[1] = RowStatus::NotCovered;
        answer
    }

    async fn text(body: Body) -> String {
        let bytes = body.collect().await.unwrap().to_bytes();
        String::from_utf8(bytes.to_vec()).unwrap()
    }

    #[tokio::test]
    async fn columns_are_json_and_csv_of_the_same_numbers() {
        let rows = 2 * ROWS + 7;
        let given = answer(rows);
        let read: Value = serde_json::from_str(&text(json_body(given.clone())).await).unwrap();
        assert_eq!(read["rows"], json!(rows));
        assert_eq!(read["columns"]["stick_share"][1], Value::Null);
        assert_eq!(read["columns"]["status"][1], json!("not_covered"));
        let csv = text(table_body(Format::Csv, given.clone()).unwrap()).await;
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), rows + 1);
        for row in [0, 1, ROWS, rows - 1] {
            let fields: Vec<&str> = lines[row + 1].split(',').collect();
            let names: Vec<&str> = lines[0].split(',').collect();
            for (name, field) in names.iter().zip(fields) {
                let known = &read["columns"][*name][row];
                match known {
                    Value::Null => assert_eq!(field, ""),
                    Value::String(word) => assert_eq!(field, word),
                    number => assert_eq!(field.parse::<f64>().ok(), number.as_f64()),
                }
            }
            assert_eq!(
                read["columns"]["force_x_n"][row],
                json!(given.column("force_x_n")[row])
            );
        }
    }
}
