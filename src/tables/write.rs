//! Writes tables of rows in the requested format, piece by piece.

use std::error::Error;
use std::fmt::Write;

use crate::arrow::ArrowWriter;
use crate::csv::{self, Precision, text_field, write_number};
use crate::parquet::TableWriter;
use crate::read::TableForm;
use crate::table::{RowTable, TableColumn, TableKind};

/// An error of writing a table.
pub type WriteError = Box<dyn Error + Send + Sync>;

/// Writes tables with equal columns, one after the other.
pub enum RowWriter {
    /// CSV: a line with the names of the columns, then a line per row.
    Csv(Vec<String>),
    /// NDJSON: an object per row.
    Ndjson,
    /// An Arrow stream, with a record batch per table.
    Arrow(Box<ArrowWriter>),
    /// A Parquet file, with a row group per table.
    Parquet(Box<TableWriter>),
}

impl RowWriter {
    /// Creates a writer of tables with these columns. It writes NDJSON for other formats than CSV, Arrow and Parquet.
    ///
    /// # Errors
    /// The head of the format cannot be written.
    pub fn new(form: TableForm, columns: &[(String, TableKind)]) -> Result<RowWriter, WriteError> {
        Ok(match form {
            TableForm::Csv => {
                RowWriter::Csv(columns.iter().map(|(name, _)| name.clone()).collect())
            }
            TableForm::Arrow => RowWriter::Arrow(Box::new(ArrowWriter::new(columns)?)),
            TableForm::Parquet => RowWriter::Parquet(Box::new(TableWriter::new(columns)?)),
            _ => RowWriter::Ndjson,
        })
    }

    /// Writes a whole table.
    ///
    /// # Errors
    /// The table cannot be written.
    pub fn whole(form: TableForm, table: RowTable) -> Result<Vec<u8>, WriteError> {
        let mut writer = RowWriter::new(form, &table.kinds())?;
        Ok([writer.head()?, writer.write(table)?, writer.finish()?].concat())
    }

    /// Returns the bytes before the first table.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn head(&mut self) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(names) => Ok(csv::head(names.iter().map(String::as_str))?),
            _ => Ok(Vec::new()),
        }
    }

    /// Returns the bytes of a table.
    ///
    /// # Errors
    /// The table cannot be written.
    pub fn write(&mut self, table: RowTable) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(_) => Ok(csv_lines(&table)?),
            RowWriter::Ndjson => Ok(json_lines(&table)?.into_bytes()),
            RowWriter::Arrow(writer) => Ok(writer.write(table)?),
            RowWriter::Parquet(writer) => Ok(writer.write(&table)?),
        }
    }

    /// Returns the bytes after the last table.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn finish(&mut self) -> Result<Vec<u8>, WriteError> {
        match self {
            RowWriter::Csv(_) | RowWriter::Ndjson => Ok(Vec::new()),
            RowWriter::Arrow(writer) => Ok(writer.finish()?),
            RowWriter::Parquet(writer) => Ok(writer.finish()?),
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
            let separator = if place == 0 { '{' } else { ',' };
            write!(text, "{separator}{name}:")?;
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
        let mut csv = RowWriter::new(TableForm::Csv, &names).unwrap();
        assert_eq!(csv.head().unwrap(), b"row\n");
        let lines = csv.write(table.clone()).unwrap();
        assert_eq!(lines, b"3,,\"a, \"\"b\"\"\"\n4,0.1,\n");
        let lines = RowWriter::Ndjson.write(table).unwrap();
        let expected =
            "{\"row\":3,\"f\":null,\"t\":\"a, \\\"b\\\"\"}\n{\"row\":4,\"f\":0.1,\"t\":null}\n";
        assert_eq!(String::from_utf8(lines).unwrap(), expected);
    }
}
