//! Tables of rows as CSV, NDJSON, an Arrow stream or a Parquet file, piece by piece.

use std::error::Error;
use std::fmt::Write;
use std::ops::Range;

use axum::body::{Body, Bytes};
use futures_util::stream::{Stream, StreamExt, TryStreamExt, iter, try_unfold};

use crate::render::csv::{self, Precision, text_field, write_number};
use crate::render::format::Format;
use crate::render::pieces::{JsonColumn, body, json_columns};
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_jobs::codec::arrow::ArrowWriter;
use railhead_jobs::codec::parquet::TableWriter;
use railhead_jobs::codec::table::{RowTable, TableColumn, TableKind};
use railhead_jobs::sync::blocking;

/// Why a table cannot be written.
pub(crate) type WriteError = Box<dyn Error + Send + Sync>;

/// Some rows of a table.
pub(crate) enum Piece {
    /// As they are sent.
    Text(Bytes),
    /// Yet to be written.
    Table(RowTable),
}

/// Writes tables with the same columns, one after the other.
pub(crate) enum RowWriter {
    /// A line with the names of the columns, then one for each row.
    Csv(Vec<String>),
    /// An object for each row.
    Ndjson,
    /// A stream of batches of records.
    Arrow(Box<ArrowWriter<Vec<u8>>>),
    /// One file, a group of rows for each table.
    Parquet(Box<TableWriter<Vec<u8>>>),
}

impl RowWriter {
    /// Writes tables of these columns as CSV, an Arrow stream or a Parquet file, and as NDJSON in any other form.
    ///
    /// # Errors
    /// The stream or the file cannot be begun.
    pub(crate) fn new(
        format: Format,
        columns: &[(String, TableKind)],
    ) -> Result<RowWriter, WriteError> {
        Ok(match format {
            Format::Csv => RowWriter::Csv(columns.iter().map(|(name, _)| name.clone()).collect()),
            Format::Arrow => RowWriter::Arrow(Box::new(ArrowWriter::new(Vec::new(), columns)?)),
            Format::Parquet => RowWriter::Parquet(Box::new(TableWriter::new(Vec::new(), columns)?)),
            _ => RowWriter::Ndjson,
        })
    }

    /// A table that is written as a whole.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn whole(format: Format, table: RowTable) -> Result<Vec<u8>, WriteError> {
        let mut writer = RowWriter::new(format, &table.kinds())?;
        Ok([writer.head()?, writer.write(table)?, writer.finish()?].concat())
    }

    /// Writes tables of these columns piece by piece as they come, with the text before and after them.
    ///
    /// # Errors
    /// The stream or the file cannot be begun.
    pub(crate) fn stream<P: Stream<Item = Result<Piece, WriteError>> + Send>(
        format: Format,
        columns: &[(String, TableKind)],
        pieces: P,
    ) -> Result<impl Stream<Item = Result<Bytes, WriteError>> + Send + use<P>, WriteError> {
        let mut writer = RowWriter::new(format, columns)?;
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

    /// What comes before the first table.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn head(&mut self) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(names) => Ok(csv::head(names.iter().map(String::as_str))?),
            _ => Ok(Vec::new()),
        }
    }

    /// One more table.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn write(&mut self, table: RowTable) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(_) => Ok(csv_lines(&table)?),
            RowWriter::Ndjson => Ok(json_lines(&table)?.into_bytes()),
            RowWriter::Arrow(writer) => {
                writer.write(table)?;
                Ok(std::mem::take(writer.inner_mut()))
            }
            RowWriter::Parquet(writer) => {
                writer.write(&table)?;
                Ok(std::mem::take(writer.inner_mut()))
            }
        }
    }

    /// What comes after the last table.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn finish(&mut self) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(_) | RowWriter::Ndjson => Ok(Vec::new()),
            RowWriter::Arrow(writer) => {
                writer.finish()?;
                Ok(std::mem::take(writer.inner_mut()))
            }
            RowWriter::Parquet(writer) => {
                writer.finish()?;
                Ok(std::mem::take(writer.inner_mut()))
            }
        }
    }
}

fn csv_lines(table: &RowTable) -> Result<Vec<u8>, WriteError> {
    let columns = &table.columns;
    let lines = csv::lines(
        columns.len(),
        0..table.row_count(),
        |out, column, row| match &columns[column].1 {
            TableColumn::Integers(values) => *out += &values[row].to_string(),
            TableColumn::Numbers(values) => write_number(out, values[row], Precision::Double, ""),
            TableColumn::Texts(values) => {
                *out += &text_field(values[row].as_deref().unwrap_or_default());
            }
        },
    );
    Ok(lines?)
}

fn json_lines(table: &RowTable) -> Result<String, WriteError> {
    let names = table.columns.iter();
    let names = names.map(|(name, _)| serde_json::to_string(name));
    let names: Vec<String> = names.collect::<Result<_, _>>()?;
    let mut text = String::with_capacity(32 * table.row_count() * names.len());
    for row in 0..table.row_count() {
        for (place, (name, (_, column))) in names.iter().zip(&table.columns).enumerate() {
            let before = if place == 0 { '{' } else { ',' };
            write!(text, "{before}{name}:")?;
            match column {
                TableColumn::Integers(values) => write!(text, "{}", values[row])?,
                TableColumn::Numbers(values) => {
                    write_number(&mut text, values[row], Precision::Double, "null");
                }
                TableColumn::Texts(values) => text.push_str(&serde_json::to_string(&values[row])?),
            }
        }
        text.push_str("}\n");
    }
    Ok(text)
}

/// Rows of a batch of Arrow records, or of a group of a Parquet file.
const BATCH_ROWS: usize = 1 << 15;

/// Rows of text written at once.
const ROWS: usize = 1024;

/// `{"rows": …, "columns": {"force_x_n": […], …, "status": […]}}`; null where a row has no number.
pub(crate) fn json_body(answer: RowsAnswer) -> Body {
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

#[cfg(test)]
mod tests {
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

    #[test]
    fn lines_quote_what_needs_it_and_leave_gaps() {
        let table = RowTable {
            columns: vec![
                ("row".to_owned(), TableColumn::Integers(vec![3, 4])),
                ("f".to_owned(), TableColumn::Numbers(vec![f64::NAN, 0.1])),
                (
                    "t".to_owned(),
                    TableColumn::Texts(vec![Some("a, \"b\"".to_owned()), None]),
                ),
            ],
        };
        let names = [("row".to_owned(), TableKind::Integers)];
        let mut csv = RowWriter::new(Format::Csv, &names).unwrap();
        assert_eq!(csv.head().unwrap(), b"row\n");
        let lines = csv.write(table.clone()).unwrap();
        assert_eq!(lines, b"3,,\"a, \"\"b\"\"\"\n4,0.1,\n");
        let lines = RowWriter::Ndjson.write(table).unwrap();
        let expected =
            "{\"row\":3,\"f\":null,\"t\":\"a, \\\"b\\\"\"}\n{\"row\":4,\"f\":0.1,\"t\":null}\n";
        assert_eq!(String::from_utf8(lines).unwrap(), expected);
    }
}
