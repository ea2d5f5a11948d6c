//! Text of a table piece by piece, made when the client takes it: a large answer takes no more memory than its table.

use std::fmt::Write;
use std::ops::Range;

use axum::body::{Body, Bytes};
use futures_util::stream;

use crate::contact::solution::words::answer::Zone;
use crate::http::render::csv;
use crate::http::render::table::{ArrayData, Precision, Rows, Table};

/// Pieces are at least this large, but for the last one.
const PIECE_BYTES: usize = 32 << 10;
/// Rows written at once.
const ROWS: usize = 256;

/// A part of a JSON text.
enum JsonPart {
    Text(String),
    /// Values of a column, parted by commas.
    Values(ColumnName, Range<usize>),
}

#[derive(Clone, Copy)]
enum ColumnName {
    X,
    Y,
    Value(usize),
}

/// The table as CSV.
pub(crate) fn csv_body(table: Table) -> Body {
    let starts = (0..table.len()).step_by(ROWS);
    let head = csv::head(&table);
    let lines = starts.map(move |start| {
        let end = (start + ROWS).min(table.len());
        csv::lines(&table, start..end)
    });
    body(std::iter::once(head).chain(lines))
}

/// The table as the JSON of a field: members written before (`"patch":0,…`), then per cell inside `cells`, or on a grid.
pub(crate) fn json_body(table: Table, members: &str) -> Body {
    let parts = parts(&table, members);
    let texts = parts.into_iter().map(move |part| match part {
        JsonPart::Text(text) => Ok::<_, std::convert::Infallible>(text.into_bytes()),
        JsonPart::Values(column, rows) => Ok(values(&table, column, rows).into_bytes()),
    });
    body(texts)
}

/// The texts, gathered into pieces; each is made when the client has taken those before it.
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

fn parts(table: &Table, members: &str) -> Vec<JsonPart> {
    let mut parts = Vec::new();
    let (open, close) = match &table.rows {
        Rows::Cells => (",\"cells\":{", "}}"),
        Rows::Grid { .. } => (",", "}"),
    };
    parts.push(JsonPart::Text(format!("{{{members}{open}")));
    if let Rows::Grid { x_mm, y_mm } = &table.rows {
        array(&mut parts, "x_mm", ColumnName::X, x_mm.len());
        array(&mut parts, "y_mm", ColumnName::Y, y_mm.len());
    }
    for (number, column) in table.columns.iter().enumerate() {
        let values = ColumnName::Value(number);
        match &table.rows {
            Rows::Cells => array(&mut parts, column.name, values, table.len()),
            Rows::Grid { x_mm, y_mm } => {
                let nx = x_mm.len();
                parts.push(JsonPart::Text(format!("\"{}\":[", column.name)));
                for iy in 0..y_mm.len() {
                    let open = if iy == 0 { "[" } else { ",[" };
                    parts.push(JsonPart::Text(open.to_owned()));
                    parts.push(JsonPart::Values(values, iy * nx..(iy + 1) * nx));
                    parts.push(JsonPart::Text("]".to_owned()));
                }
                parts.push(JsonPart::Text("],".to_owned()));
            }
        }
    }
    // The comma after the last array makes way.
    if let Some(JsonPart::Text(last)) = parts.last_mut() {
        last.pop();
    }
    parts.push(JsonPart::Text(close.to_owned()));
    parts
}

/// `"name":[…],`
fn array(parts: &mut Vec<JsonPart>, name: &str, column: ColumnName, count: usize) {
    parts.push(JsonPart::Text(format!("\"{name}\":[")));
    for start in (0..count).step_by(ROWS) {
        if start > 0 {
            parts.push(JsonPart::Text(",".to_owned()));
        }
        parts.push(JsonPart::Values(column, start..(start + ROWS).min(count)));
    }
    parts.push(JsonPart::Text("],".to_owned()));
}

fn values(table: &Table, column: ColumnName, rows: Range<usize>) -> String {
    let mut out = String::new();
    for row in rows {
        if !out.is_empty() {
            out.push(',');
        }
        match (column, &table.rows) {
            (ColumnName::X, Rows::Grid { x_mm, .. }) => push(&mut out, x_mm[row], table.precision),
            (ColumnName::Y, Rows::Grid { y_mm, .. }) => push(&mut out, y_mm[row], table.precision),
            (ColumnName::Value(number), _) => match &table.columns[number].data {
                ArrayData::Numbers(numbers) => push(&mut out, numbers[row], table.precision),
                ArrayData::Integers(numbers) => {
                    // Writing to a string cannot fail.
                    let _ = write!(out, "{}", numbers[row]);
                }
                ArrayData::Zones(zones) => push_zone(&mut out, zones[row]),
            },
            _ => unreachable!("the parts were made from this table"),
        }
    }
    out
}

/// The number as JSON; null where there is none.
fn push(out: &mut String, value: f64, precision: Precision) {
    let _ = match (serde_json::Number::from_f64(value), precision) {
        (None, _) => write!(out, "null"),
        (Some(number), Precision::Double) => write!(out, "{number}"),
        (Some(_), Precision::Single) => write!(out, "{:?}", csv::single(value)),
    };
}

fn push_zone(out: &mut String, zone: Option<Zone>) {
    match zone {
        Some(zone) => {
            let _ = write!(out, "\"{}\"", zone.name());
        }
        None => out.push_str("null"),
    }
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;
    use serde_json::{Value, json};

    use super::*;
    use crate::contact::case::words::solver::Output;
    use crate::contact::solution::words::answer::{PatchCells, PointFields};
    use crate::http::render::table::TableColumn;

    async fn text(body: Body) -> String {
        let bytes = body.collect().await.unwrap().to_bytes();
        String::from_utf8(bytes.to_vec()).unwrap()
    }

    /// Numbers that need all their digits, and more rows than are written at once.
    fn numbers(count: usize) -> Vec<f64> {
        (1..=count).map(|number| 1.0 / number as f64).collect()
    }

    fn column(name: &'static str, data: ArrayData) -> TableColumn {
        TableColumn { name, data }
    }

    fn on_grid(x_mm: Vec<f64>, y_mm: Vec<f64>, columns: Vec<TableColumn>) -> Table {
        Table {
            rows: Rows::Grid { x_mm, y_mm },
            columns,
            precision: Precision::Double,
        }
    }

    async fn read(table: Table) -> Value {
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
            let table = Table::of(&[Output::Zones, Output::Slip], None, cells, values);
            assert_eq!(read(table).await, whole);
        }
        let row = [0.1, f64::NAN, -3e-300];
        let zones = [Some(Zone::Stick), None, Some(Zone::Slip)];
        let table = on_grid(
            numbers(3),
            numbers(700),
            vec![
                column("zone", ArrayData::Zones(zones.repeat(700))),
                column("pressure_mpa", ArrayData::Numbers(row.repeat(700))),
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
        let pressure = column("pressure_mpa", ArrayData::Numbers(vec![1e9 + 1.0]));
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
        let pressure = ArrayData::Numbers([1.5, f64::NAN].repeat(400));
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
