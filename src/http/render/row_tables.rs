//! Streams tables of rows as CSV, NDJSON, an Arrow stream or a Parquet file.

use std::ops::Range;

use axum::body::{Body, Bytes};
use futures_util::stream::{Stream, StreamExt, TryStreamExt, iter, try_unfold};
use serde_json::json;

use crate::render::format::Format;
use crate::render::pieces::{JsonColumn, body, json_columns};
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_jobs::run::model::{REASON, REMARKS};
use railhead_jobs::sync::blocking;
use railhead_tables::csv::{Precision, write_number};
use railhead_tables::table::{RowTable, TableColumn, TableKind};
use railhead_tables::write::{RowWriter, WriteError};

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
const ROWS: usize = 1024;

/// The columns of texts of an evaluation, after those of numbers.
const TEXTS: [&str; 3] = ["status", REASON, REMARKS];

/// Returns the text of a row in a column of [`TEXTS`], if it has one.
fn text_of(answer: &RowsAnswer, name: &str, row: usize) -> Option<String> {
    let text = match name {
        REASON => answer.reason(row),
        REMARKS => answer.remarks(row).to_owned(),
        _ => answer.status[row].name().to_owned(),
    };
    Some(text).filter(|text| !text.is_empty())
}

/// `{"rows": …, "columns": {"force_x_n": […], …, "status": […], …}}`; null where a row has no number or text.
pub(crate) fn json_body(answer: RowsAnswer) -> Body {
    let rows = answer.status.len();
    let names = answer.numbers.iter().map(|(name, _)| *name);
    let columns = names.chain(TEXTS);
    let columns = columns.map(|name| JsonColumn::new(name, rows)).collect();
    let open = format!("{{\"rows\":{rows},\"columns\":{{");
    json_columns(open, columns, "}}", move |out, column, row| {
        match answer.numbers.get(column) {
            Some((_, values)) => write_number(out, values[row], Precision::Double, "null"),
            None => {
                let text = text_of(&answer, TEXTS[column - answer.numbers.len()], row);
                *out += &json!(text).to_string();
            }
        }
    })
}

/// Returns the columns as a table in this format.
///
/// # Errors
/// The head cannot be written.
pub(crate) fn table_body(format: Format, answer: RowsAnswer) -> Result<Body, WriteError> {
    let rows = answer.status.len();
    let step = match format {
        Format::Arrow | Format::Parquet => BATCH_ROWS,
        _ => ROWS,
    };
    let mut writer = RowWriter::new(format.table(), &part(&answer, 0..0).kinds())?;
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
    let numbers = answer.numbers.iter().map(|(name, column)| {
        let column = TableColumn::Numbers(column[range.clone()].to_vec());
        ((*name).to_owned(), column)
    });
    let texts = TEXTS.map(|name| {
        let texts = range.clone().map(|row| text_of(answer, name, row));
        (name.to_owned(), TableColumn::Texts(texts.collect()))
    });
    RowTable {
        columns: numbers.chain(texts).collect(),
    }
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;
    use serde_json::Value;

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
        let mut answer = RowsAnswer::default();
        answer.numbers = numbers;
        answer.status = vec![RowStatus::Ok; rows];
        answer.status[1] = RowStatus::NotFinite;
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
        assert_eq!(read["columns"]["status"][1], json!("not_finite"));
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
