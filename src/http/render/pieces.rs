//! Streams the text of a table, which is written while the client receives it, so that a large response needs no memory beyond its table.

use std::convert::Infallible;

use axum::body::{Body, Bytes};
use futures_util::stream;

use railhead_tables::cells::{CellRows, CellTable};
use railhead_tables::csv;

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
