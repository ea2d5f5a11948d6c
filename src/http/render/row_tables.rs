//! Tables of rows as CSV, NDJSON, an Arrow stream or a Parquet file, piece by piece.

use std::error::Error;
use std::fmt::Write;

use crate::http::render::csv::{text_field, write_number};
use crate::http::render::format::Format;
use crate::jobs::codec::arrow::ArrowWriter;
use crate::jobs::codec::parquet::TableWriter;
use crate::jobs::codec::table::{RowTable, TableColumn, TableKind};

/// Why a table cannot be written.
pub(crate) type WriteError = Box<dyn Error + Send + Sync>;

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
        let columns = table.columns.iter();
        let columns: Vec<_> = columns
            .map(|(name, column)| (name.clone(), column.kind()))
            .collect();
        let mut writer = RowWriter::new(format, &columns)?;
        Ok([writer.head()?, writer.write(table)?, writer.finish()?].concat())
    }

    /// What comes before the first table.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn head(&mut self) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(names) => {
                let mut writer = csv::Writer::from_writer(Vec::new());
                writer.write_record(names.iter().map(|name| text_field(name).into_owned()))?;
                Ok(writer.into_inner()?)
            }
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
    let mut writer = csv::Writer::from_writer(Vec::with_capacity(
        16 * table.row_count() * table.columns.len(),
    ));
    let mut field = String::new();
    for row in 0..table.row_count() {
        for (_, column) in &table.columns {
            field.clear();
            match column {
                TableColumn::Integers(values) => write!(field, "{}", values[row])?,
                TableColumn::Numbers(values) => write_number(&mut field, values[row], ""),
                TableColumn::Texts(values) => {
                    field.push_str(&text_field(values[row].as_deref().unwrap_or_default()));
                }
            }
            writer.write_field(&field)?;
        }
        writer.write_record(None::<&[u8]>)?;
    }
    Ok(writer.into_inner()?)
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
                TableColumn::Numbers(values) => write_number(&mut text, values[row], "null"),
                TableColumn::Texts(values) => text.push_str(&serde_json::to_string(&values[row])?),
            }
        }
        text.push_str("}\n");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

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
