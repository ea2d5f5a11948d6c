//! Reads tables of rows in every format of requests: runs, batches and evaluations.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};

use bytes::Bytes;
use parquet::errors::Result as ParquetResult;
use parquet::file::reader::ChunkReader;
use railhead_contact::evaluate::varied::Values;

use crate::arrow;
use crate::error::{Result, faulty, too_large};
use crate::npz::read_arrays;
use crate::parquet::TableReader;
use crate::table::{Chunk, RowTable, TableColumn, TableKind, Title};
use crate::text::{CsvRows, JsonRows};
use crate::titles::{NamedColumns, TitledColumn, require_few};

/// Largest row group of a Parquet file, decompressed, in bytes.
const GROUP_BYTES_MAX: i64 = 1 << 28;

/// Longest row of a CSV table, in bytes.
const ROW_BYTES_MAX: usize = 1 << 20;

/// The format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableForm {
    /// CSV, whose first line names the columns.
    Csv,
    /// NDJSON, an object per row.
    Ndjson,
    /// An Arrow stream or file.
    Arrow,
    /// A Parquet file.
    Parquet,
    /// An archive of NumPy arrays.
    Npz,
}

impl TableForm {
    /// Description of the formats, for the refusal of another one.
    pub const ALLOWED: &str = "a table with `text/csv`, `application/x-ndjson`, `application/vnd.apache.arrow.stream`, \
                               `application/vnd.apache.parquet` or `application/x-npz`, or a template and a table with `multipart/form-data`";

    /// Returns the format of a media type.
    #[must_use]
    pub fn of(essence: &str) -> Option<TableForm> {
        Some(match essence {
            "text/csv" => TableForm::Csv,
            "application/x-ndjson" | "application/ndjson" | "application/jsonl" => {
                TableForm::Ndjson
            }
            "application/vnd.apache.arrow.stream" | "application/vnd.apache.arrow.file" => {
                TableForm::Arrow
            }
            "application/vnd.apache.parquet" => TableForm::Parquet,
            "application/x-npz" => TableForm::Npz,
            _ => return None,
        })
    }

    /// Whether the format is compressed, so that the values may have many more bytes than the table.
    #[must_use]
    pub fn packed(self) -> bool {
        matches!(self, TableForm::Parquet | TableForm::Npz)
    }
}

/// The bytes of a table.
#[derive(Debug)]
pub enum TableSource {
    /// A file, at its beginning.
    File(File),
    /// Bytes in memory.
    Memory(Bytes),
}

/// A seekable source.
trait Seekable: BufRead + Seek + Send {}

impl<T: BufRead + Seek + Send> Seekable for T {}

impl TableSource {
    fn reader(self) -> Box<dyn Seekable> {
        match self {
            TableSource::File(file) => Box::new(BufReader::new(file)),
            TableSource::Memory(bytes) => Box::new(Cursor::new(bytes)),
        }
    }
}

/// A table that is read some rows at a time.
pub struct TableRows {
    /// The titles of the columns.
    pub titles: Vec<Title>,
    rows: Rows,
}

enum Rows {
    Csv(Box<CsvRows<Box<dyn Seekable>>>),
    Other(Box<dyn Iterator<Item = Result<Chunk>>>),
}

impl Iterator for TableRows {
    type Item = Result<Chunk>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.rows {
            Rows::Csv(rows) => rows.next(),
            Rows::Other(rows) => rows.next(),
        }
    }
}

impl TableRows {
    /// Opens a table. Blocks, as reading its rows does. An archive of arrays is held in memory, with at most `unpacked_max` bytes.
    ///
    /// # Errors
    /// `faulty-table`: the table is malformed or has too many columns; `body-too-large`: an archive has more bytes.
    pub fn new(form: TableForm, source: TableSource, unpacked_max: usize) -> Result<TableRows> {
        match form {
            TableForm::Csv => {
                let rows = CsvRows::new(source.reader(), ROW_BYTES_MAX)?;
                Ok(TableRows {
                    titles: rows.titles.clone(),
                    rows: Rows::Csv(Box::new(rows)),
                })
            }
            TableForm::Ndjson => {
                let rows = JsonRows::new(source.reader())?;
                Ok(TableRows {
                    titles: rows.titles.clone(),
                    rows: Rows::Other(Box::new(rows)),
                })
            }
            TableForm::Arrow => {
                let damaged = |error| faulty(format!("the Arrow data cannot be read: {error}"));
                let tables = arrow::read(source.reader()).map_err(damaged)?;
                TableRows::of_tables(tables.map(move |table| table.map_err(damaged)))
            }
            TableForm::Parquet => match source {
                TableSource::File(file) => TableRows::of_tables(groups(TableReader::new(file))?),
                TableSource::Memory(bytes) => {
                    TableRows::of_tables(groups(TableReader::new(bytes))?)
                }
            },
            TableForm::Npz => {
                let table = npz_table(source.reader(), unpacked_max);
                TableRows::of_tables(std::iter::once(table))
            }
        }
    }

    /// Finds the place of each column in the case; to be called before the rows are read. Columns that are copied to the results may be read
    /// as texts from then on, see [`Title::text_if_copied`].
    ///
    /// # Errors
    /// See [`NamedColumns::columns`].
    pub fn named(&mut self, named: &NamedColumns) -> Result<Vec<TitledColumn>> {
        let columns = named.columns(&self.titles)?;
        if let Rows::Csv(rows) = &mut self.rows {
            for (title, column) in rows.titles.iter_mut().zip(&columns) {
                title.text = column.text;
            }
        }
        Ok(columns)
    }

    /// Reads the rows of tables that all have the columns of the first.
    fn of_tables(
        mut tables: impl Iterator<Item = Result<RowTable>> + 'static,
    ) -> Result<TableRows> {
        let first = tables
            .next()
            .ok_or_else(|| faulty("the table has no rows"))??;
        require_few(first.columns.len())?;
        let titles = first.columns.iter().map(|(name, values)| Title {
            name: name.clone(),
            unit: None,
            text: values.kind() == TableKind::Texts,
            text_if_copied: false,
        });
        Ok(TableRows {
            titles: titles.collect(),
            rows: Rows::Other(Box::new(
                std::iter::once(Ok(first))
                    .chain(tables)
                    .map(|table| Ok(table?.columns.into_iter().map(values_of).collect())),
            )),
        })
    }
}

/// Reads the arrays of an NPZ archive.
fn npz_table(source: impl Read, bytes_max: usize) -> Result<RowTable> {
    let mut archive = Vec::new();
    source
        .take(bytes_max as u64 + 1)
        .read_to_end(&mut archive)
        .map_err(|error| faulty(format!("the NPZ archive cannot be read: {error}")))?;
    if archive.len() > bytes_max {
        return Err(too_large(bytes_max));
    }
    let arrays = read_arrays(archive.into(), bytes_max)?.into_iter();
    let columns = arrays.map(|(name, values)| (name, TableColumn::Numbers(values)));
    Ok(RowTable {
        columns: columns.collect(),
    })
}

/// Reads the row groups of a Parquet file.
fn groups<R: ChunkReader + 'static>(
    reader: ParquetResult<TableReader<R>>,
) -> Result<impl Iterator<Item = Result<RowTable>>> {
    let damaged = |error| faulty(format!("the Parquet file cannot be read: {error}"));
    let reader = reader.map_err(damaged)?;
    require_few(reader.names().len())?;
    let large = (0..reader.groups()).find(|group| reader.group_size(*group).1 > GROUP_BYTES_MAX);
    if let Some(group) = large {
        return Err(faulty(format!(
            "the group of rows {group} unpacks to more than {GROUP_BYTES_MAX} bytes; write smaller groups"
        )));
    }
    Ok((0..reader.groups()).map(move |group| reader.read(group, |_| true).map_err(damaged)))
}

/// Smallest number above which not every whole number has a value of its own, 2⁵³.
const WHOLE_MAX: f64 = 9_007_199_254_740_992.0;

/// Refuses a copied number that may have been a longer whole number, such as the id of a measurement.
///
/// # Errors
/// The reason.
pub fn require_exact(number: f64) -> std::result::Result<(), String> {
    match number.abs() < WHOLE_MAX || !number.is_finite() {
        true => Ok(()),
        false => Err(format!(
            "{number:e} given; copied numbers must be less than 2^53, since larger whole numbers are rounded: give long ids as texts"
        )),
    }
}

fn values_of((_, column): (String, TableColumn)) -> Values {
    match column {
        TableColumn::Numbers(numbers) => Values::Numbers(numbers),
        TableColumn::Texts(texts) => Values::Texts(texts),
        #[expect(clippy::cast_precision_loss, reason = "numbers of a case have 64 bits")]
        TableColumn::Integers(values) => {
            Values::Numbers(values.into_iter().map(|value| value as f64).collect())
        }
    }
}
