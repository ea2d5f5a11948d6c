//! Streams the text of a table, which is written while the client receives it, so that a large response needs no memory beyond its table.
//!
//! Tables of cells are written as CSV or JSON, tables of rows as CSV, JSON, NDJSON, an Arrow stream or a Parquet file.

use std::convert::Infallible;
use std::ops::Range;

use axum::body::{Body, Bytes};
use futures_util::stream;
use futures_util::stream::{Stream, StreamExt, TryStreamExt, iter, try_unfold};

use crate::render::format::Format;
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_jobs::sync::blocking;
use railhead_tables::cells::{CellRows, CellTable};
use railhead_tables::csv;
use railhead_tables::csv::{Precision, write_number};
use railhead_tables::table::{RowTable, TableColumn, TableKind};
use railhead_tables::write::{RowWriter, WriteError};

/// Least size of a piece except the last, in bytes.
const PIECE_BYTES: usize = 32 << 10;
/// Number of rows written at once.
const ROWS: usize = 256;

/// Returns the table as CSV. Zones are words; values outside the patch are empty.
pub(crate) fn csv_body(table: CellTable) -> Body {
    let names = table.names();
    let columns = names.len();
    let lines = (0..table.row_count()).step_by(ROWS).map(move |start| {
        let rows = start..(start + ROWS).min(table.row_count());
        csv::lines(columns, rows, |out, column, row| {
            table.write(out, column, table.index(column, row), ["", ""]);
        })
    });
    body(std::iter::once(csv::head(names)).chain(lines))
}

/// Returns the table as the JSON of a field: these members (`"patch":0,…`), then the columns, per cell inside `cells`.
pub(crate) fn json_body(table: CellTable, members: &str) -> Body {
    let (open, close, axes) = match &table.rows {
        CellRows::Cells => (",\"cells\":{", "}}", Vec::new()),
        CellRows::Grid { x_mm, y_mm } => (",", "}", vec![x_mm.len(), y_mm.len()]),
    };
    let columns = table.names().into_iter().enumerate();
    let columns = columns.map(|(place, name)| match axes.get(place) {
        Some(count) => JsonColumn::new(name, *count),
        None => JsonColumn {
            inner: axes.first().copied(),
            ..JsonColumn::new(name, table.row_count())
        },
    });
    let columns = columns.collect();
    json_columns(
        format!("{{{members}{open}"),
        columns,
        close,
        move |out, column, index| {
            table.write(out, column, index, ["null", "\""]);
        },
    )
}

/// A column of JSON.
pub(crate) struct JsonColumn {
    name: &'static str,
    /// Number of values.
    count: usize,
    /// Length of nested arrays; `None` for an array of values.
    inner: Option<usize>,
}

impl JsonColumn {
    /// Creates a column with this many values.
    pub(crate) fn new(name: &'static str, count: usize) -> JsonColumn {
        JsonColumn {
            name,
            count,
            inner: None,
        }
    }
}

/// Streams `"name":[…],…` of each column between two texts; `write` appends the value of a column and a row.
pub(crate) fn json_columns(
    open: String,
    columns: Vec<JsonColumn>,
    close: &'static str,
    write: impl Fn(&mut String, usize, usize) + Send + 'static,
) -> Body {
    let mut parts = vec![(open, 0, 0..0)];
    for (place, JsonColumn { name, count, inner }) in columns.into_iter().enumerate() {
        let (step, [begin, between, end]) = match inner.filter(|_| count > 0) {
            Some(inner) => (inner, ["[[", "],[", "]]"]),
            None => (ROWS, ["[", ",", "]"]),
        };
        let comma = if place == 0 { "" } else { "," };
        let mut before = format!("{comma}\"{name}\":{begin}");
        for start in (0..count).step_by(step) {
            let rows = start..(start + step).min(count);
            let before = std::mem::replace(&mut before, between.to_owned());
            parts.push((before, place, rows));
        }
        let begun = if count == 0 { before } else { String::new() };
        parts.push((begun + end, 0, 0..0));
    }
    parts.push((close.to_owned(), 0, 0..0));
    body(parts.into_iter().map(move |(mut text, column, rows)| {
        let first = rows.start;
        for row in rows {
            if row > first {
                text.push(',');
            }
            write(&mut text, column, row);
        }
        Ok::<_, Infallible>(text.into_bytes())
    }))
}

/// Joins texts to pieces. Each piece is created when the client has received those before it.
pub(crate) fn body<E>(mut texts: impl Iterator<Item = Result<Vec<u8>, E>> + Send + 'static) -> Body
where
    E: std::error::Error + Send + Sync + 'static,
{
    let pieces = std::iter::from_fn(move || {
        let mut piece = Vec::with_capacity(2 * PIECE_BYTES);
        while piece.len() < PIECE_BYTES {
            match texts.next() {
                Some(Ok(text)) => piece.extend_from_slice(&text),
                Some(Err(error)) => return Some(Err(error)),
                None => break,
            }
        }
        (!piece.is_empty()).then(|| Ok(Bytes::from(piece)))
    });
    Body::from_stream(stream::iter(pieces))
}

/// Some rows of a table.
pub(crate) enum Piece {
    /// Text in the format of the response.
    Text(Bytes),
    /// A table that is not yet written.
    Table(RowTable),
}

/// Writes tables of these columns as they arrive, with the head and the end of the format.
///
/// # Errors
/// The head cannot be written.
pub(crate) fn stream<P: Stream<Item = Result<Piece, WriteError>> + Send>(
    format: Format,
    columns: &[(String, TableKind)],
    pieces: P,
) -> Result<impl Stream<Item = Result<Bytes, WriteError>> + Send + use<P>, WriteError> {
    let mut writer = RowWriter::new(format.table(), columns)?;
    let head = Bytes::from(writer.head()?);
    let state = Some((Box::pin(pieces), writer));
    let text = try_unfold(state, async |state| {
        let Some((mut pieces, mut writer)) = state else {
            return Ok(None);
        };
        let text = match pieces.try_next().await? {
            Some(Piece::Text(text)) => text,
            Some(Piece::Table(table)) => {
                let written = blocking(move || (writer.write(table), writer));
                let (text, back) = written.await?;
                writer = back;
                text?.into()
            }
            None => return Ok(Some((writer.finish()?.into(), None))),
        };
        Ok(Some((text, Some((pieces, writer)))))
    });
    Ok(iter([Ok(head)]).chain(text))
}

/// Number of rows of an Arrow record batch or a Parquet row group.
const BATCH_ROWS: usize = 1 << 15;

/// Number of rows of text written at once.
const ROWS_PER_PIECE: usize = 1024;

/// `{"rows": …, "columns": {"force_x_n": […], …, "status": […]}}`; null where a row has no number.
pub(crate) fn rows_json_body(answer: RowsAnswer) -> Body {
    let rows = answer.status.len();
    let names = answer.numbers.iter().map(|(name, _)| *name);
    let columns = names.chain(["status"]);
    let columns = columns.map(|name| JsonColumn::new(name, rows)).collect();
    let open = format!("{{\"rows\":{rows},\"columns\":{{");
    json_columns(open, columns, "}}", move |out, column, row| {
        match answer.numbers.get(column) {
            Some((_, values)) => write_number(out, values[row], Precision::Double, "null"),
            None => *out += &format!("\"{}\"", answer.status[row].name()),
        }
    })
}

/// Returns the columns as a table in this format.
///
/// # Errors
/// The head cannot be written.
pub(crate) fn table_body(format: Format, answer: RowsAnswer) -> Result<Body, WriteError> {
    let columns = answer.columns().into_iter();
    let columns: Vec<_> = columns
        .map(|(name, _)| (name.to_owned(), TableKind::Numbers))
        .chain([("status".to_owned(), TableKind::Texts)])
        .collect();
    let rows = answer.status.len();
    let step = match format {
        Format::Arrow | Format::Parquet => BATCH_ROWS,
        _ => ROWS_PER_PIECE,
    };
    let mut writer = RowWriter::new(format.table(), &columns)?;
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

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;
    use serde_json::{Value, json};

    use super::*;
    use crate::render::table::cell_table;
    use railhead_contact::case::words::solver::Output;
    use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};
    use railhead_tables::cells::{CellColumn, CellData};
    use railhead_tables::csv::Precision;

    async fn text(body: Body) -> String {
        let bytes = body.collect().await.unwrap().to_bytes();
        String::from_utf8(bytes.to_vec()).unwrap()
    }

    /// Numbers that need all their digits, and more rows than are written at once.
    fn numbers(count: usize) -> Vec<f64> {
        (1..=count).map(|number| 1.0 / number as f64).collect()
    }

    fn column(name: &'static str, data: CellData) -> CellColumn {
        CellColumn { name, data }
    }

    fn on_grid(x_mm: Vec<f64>, y_mm: Vec<f64>, columns: Vec<CellColumn>) -> CellTable {
        CellTable {
            rows: CellRows::Grid { x_mm, y_mm },
            columns,
            precision: Precision::Double,
        }
    }

    async fn read(table: CellTable) -> Value {
        serde_json::from_str(&text(json_body(table, "\"patch\":1")).await).unwrap()
    }

    #[tokio::test]
    async fn pieces_of_json_are_what_the_whole_would_be() {
        for count in [0, 1, ROWS, 3 * ROWS + 1] {
            let cells = PatchCells {
                x_mm: numbers(count),
                y_mm: numbers(count),
                dx_mm: numbers(count),
                dy_mm: numbers(count),
                strip: (0..count as u32).collect(),
                ..PatchCells::default()
            };
            let values = PointFields {
                zone: Some(vec![Zone::Slip; count]),
                slip_x: Some(numbers(count)),
                traction_x_mpa: Some(numbers(count)),
                ..PointFields::default()
            };
            let whole = json!({ "patch": 1, "cells": {
                "x_mm": cells.x_mm, "y_mm": cells.y_mm, "dx_mm": cells.dx_mm, "dy_mm": cells.dy_mm, "strip": cells.strip,
                "zone": values.zone, "slip_x": values.slip_x,
            } });
            let table = cell_table(&[Output::Zones, Output::Slip], None, cells, values);
            assert_eq!(read(table).await, whole);
        }
        let row = [0.1, f64::NAN, -3e-300];
        let zones = [Some(Zone::Stick), None, Some(Zone::Slip)];
        let table = on_grid(
            numbers(3),
            numbers(700),
            vec![
                column("zone", CellData::Zones(zones.repeat(700))),
                column("pressure_mpa", CellData::Numbers(row.repeat(700))),
            ],
        );
        let whole = json!({
            "patch": 1, "x_mm": numbers(3), "y_mm": numbers(700),
            "zone": vec![zones; 700], "pressure_mpa": vec![json!([0.1, null, -3e-300]); 700],
        });
        assert_eq!(read(table).await, whole);
    }

    #[tokio::test]
    async fn single_precision_is_the_nearest_number_of_32_bits() {
        let pressure = column("pressure_mpa", CellData::Numbers(vec![1e9 + 1.0]));
        let mut table = on_grid(vec![1.0 / 3.0], vec![1e-300], vec![pressure]);
        table.precision = Precision::Single;
        let csv = text(csv_body(table.clone())).await;
        assert_eq!(csv.lines().nth(1), Some("0.33333334,0.0,1000000000.0"));
        let json = read(table).await;
        assert_eq!(json["x_mm"][0].as_f64().map(csv::single), Some(1.0 / 3.0));
        assert_eq!(json["pressure_mpa"][0][0], 1e9);
    }

    #[tokio::test]
    async fn a_table_has_one_line_per_row_after_its_head() {
        let pressure = CellData::Numbers([1.5, f64::NAN].repeat(400));
        let pressure = vec![column("pressure_mpa", pressure)];
        let text = text(csv_body(on_grid(numbers(2), numbers(400), pressure))).await;
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 801);
        assert_eq!(
            lines[..3],
            ["x_mm,y_mm,pressure_mpa", "1.0,1.0,1.5", "0.5,1.0,"]
        );
    }
}

#[cfg(test)]
mod row_tables_tests {
    use http_body_util::BodyExt;
    use serde_json::{Value, json};

    use super::*;
    use railhead_contact::evaluate::answer::RowStatus;

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
        let rows = 2 * ROWS_PER_PIECE + 7;
        let given = answer(rows);
        let read: Value = serde_json::from_str(&text(rows_json_body(given.clone())).await).unwrap();
        assert_eq!(read["rows"], json!(rows));
        assert_eq!(read["columns"]["stick_share"][1], Value::Null);
        assert_eq!(read["columns"]["status"][1], json!("not_covered"));
        let csv = text(table_body(Format::Csv, given.clone()).unwrap()).await;
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), rows + 1);
        for row in [0, 1, ROWS_PER_PIECE, rows - 1] {
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
