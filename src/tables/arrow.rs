//! Reads and writes tables of rows as Arrow: writes streams, reads streams and files.

use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type,
    UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_ipc::reader::{FileReader, StreamReader};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType, Field, Schema};

use crate::table::{COLUMNS_MAX, RowTable, TableColumn, TableKind};
use crate::{DAMAGED, guarded};

/// The first bytes of a file; a stream begins differently.
const FILE_MAGIC: &[u8] = b"ARROW1";

/// Writes tables with equal columns as a stream, with a record batch per table.
pub struct ArrowWriter {
    stream: StreamWriter<Vec<u8>>,
    schema: Arc<Schema>,
}

impl ArrowWriter {
    /// Begins a stream of these columns.
    ///
    /// # Errors
    /// Writing fails.
    pub fn new(columns: &[(String, TableKind)]) -> Result<ArrowWriter, ArrowError> {
        let fields = columns.iter().map(|(name, kind)| match kind {
            TableKind::Integers => Field::new(name, DataType::Int64, false),
            TableKind::Numbers => Field::new(name, DataType::Float64, true),
            TableKind::Texts => Field::new(name, DataType::Utf8, true),
        });
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        Ok(ArrowWriter {
            stream: StreamWriter::try_new(Vec::new(), &schema)?,
            schema,
        })
    }

    /// Returns the bytes of a table as a record batch; the first bytes of the stream precede those of the first table.
    ///
    /// # Errors
    /// The table has other columns, or writing fails.
    pub fn write(&mut self, table: RowTable) -> Result<Vec<u8>, ArrowError> {
        let columns = table.columns.into_iter().map(|(_, column)| match column {
            TableColumn::Integers(values) => Arc::new(Int64Array::from(values)) as ArrayRef,
            TableColumn::Numbers(values) => {
                let there = |value: f64| (!value.is_nan()).then_some(value);
                Arc::new(values.into_iter().map(there).collect::<Float64Array>()) as ArrayRef
            }
            TableColumn::Texts(values) => {
                Arc::new(values.into_iter().collect::<StringArray>()) as ArrayRef
            }
        });
        let batch = RecordBatch::try_new(self.schema.clone(), columns.collect())?;
        self.stream.write(&batch)?;
        Ok(std::mem::take(self.stream.get_mut()))
    }

    /// Returns the end of the stream.
    ///
    /// # Errors
    /// Writing fails.
    pub fn finish(&mut self) -> Result<Vec<u8>, ArrowError> {
        self.stream.finish()?;
        Ok(std::mem::take(self.stream.get_mut()))
    }
}

/// Reads the record batches of a stream or of a file, one after the other. Damaged bytes are errors.
///
/// # Errors
/// The source is neither a stream nor a file, or has too many columns.
pub fn read<R: Read + Seek + Send + 'static>(
    mut source: R,
) -> Result<impl Iterator<Item = Result<RowTable, ArrowError>>, ArrowError> {
    let mut begin = [0; FILE_MAGIC.len()];
    let read = source.read(&mut begin)?;
    source.seek(SeekFrom::Start(0))?;
    let damaged = || ArrowError::IpcError(DAMAGED.to_owned());
    let opened = guarded(|| -> Result<(Batches, Arc<Schema>), ArrowError> {
        Ok(match begin[..read] == *FILE_MAGIC {
            true => {
                let reader = FileReader::try_new(source, None)?;
                let schema = reader.schema();
                (Box::new(reader), schema)
            }
            false => {
                let reader = StreamReader::try_new(source, None)?;
                let schema = reader.schema();
                (Box::new(reader), schema)
            }
        })
    });
    let (batches, schema) = opened.ok_or_else(damaged)??;
    let columns = schema.fields().len();
    if columns > COLUMNS_MAX {
        let detail = format!("{columns} columns; at most {COLUMNS_MAX} are allowed");
        return Err(ArrowError::SchemaError(detail));
    }
    // Reading ends at the first error.
    let mut batches = Some(batches);
    Ok(std::iter::from_fn(move || {
        let mut reader = batches.take()?;
        let next = guarded(|| {
            let batch = reader.next()?.map_err(explained);
            Some(batch.and_then(|batch| table(&batch)))
        });
        let next = next.unwrap_or_else(|| Some(Err(damaged())));
        if matches!(next, Some(Ok(_))) {
            batches = Some(reader);
        }
        next
    }))
}

/// An iterator over record batches.
type Batches = Box<dyn Iterator<Item = Result<RecordBatch, ArrowError>> + Send>;

/// Replaces an error of the library by one with advice.
fn explained(error: ArrowError) -> ArrowError {
    match error.to_string().contains("decompression requires") {
        true => ArrowError::IpcError(
            "its buffers are compressed; write them without compression, or as Parquet".to_owned(),
        ),
        false => error,
    }
}

fn table(batch: &RecordBatch) -> Result<RowTable, ArrowError> {
    let fields = batch.schema();
    let columns = fields.fields().iter().zip(batch.columns());
    let columns = columns.map(|(field, array)| Ok((field.name().clone(), column(field, array)?)));
    Ok(RowTable {
        columns: columns.collect::<Result<_, ArrowError>>()?,
    })
}

fn column(field: &Field, array: &ArrayRef) -> Result<TableColumn, ArrowError> {
    fn numbers<T: ArrowPrimitiveType>(
        array: &ArrayRef,
        number: fn(T::Native) -> f64,
    ) -> TableColumn {
        let values = array.as_primitive::<T>().iter();
        TableColumn::Numbers(values.map(|value| value.map_or(f64::NAN, number)).collect())
    }
    fn texts<'a>(values: impl Iterator<Item = Option<&'a str>>) -> TableColumn {
        TableColumn::Texts(values.map(|text| text.map(str::to_owned)).collect())
    }
    #[expect(clippy::cast_precision_loss, reason = "numbers of a case have 64 bits")]
    Ok(match array.data_type() {
        DataType::Float64 => numbers::<Float64Type>(array, |value| value),
        DataType::Float32 => numbers::<Float32Type>(array, f64::from),
        DataType::Int64 if array.null_count() == 0 => {
            TableColumn::Integers(array.as_primitive::<Int64Type>().values().to_vec())
        }
        DataType::Int64 => numbers::<Int64Type>(array, |value| value as f64),
        DataType::Int32 => numbers::<Int32Type>(array, f64::from),
        DataType::Int16 => numbers::<Int16Type>(array, f64::from),
        DataType::Int8 => numbers::<Int8Type>(array, f64::from),
        DataType::UInt64 => numbers::<UInt64Type>(array, |value| value as f64),
        DataType::UInt32 => numbers::<UInt32Type>(array, f64::from),
        DataType::UInt16 => numbers::<UInt16Type>(array, f64::from),
        DataType::UInt8 => numbers::<UInt8Type>(array, f64::from),
        DataType::Utf8 => texts(array.as_string::<i32>().iter()),
        DataType::LargeUtf8 => texts(array.as_string::<i64>().iter()),
        DataType::Utf8View => texts(array.as_string_view().iter()),
        DataType::Dictionary(_, of) if of.is_string() => {
            let words = array.as_any_dictionary();
            let TableColumn::Texts(texts) = column(field, words.values())? else {
                unreachable!("strings are texts")
            };
            let keys = words.normalized_keys().into_iter().enumerate();
            let text =
                |(row, key): (usize, usize)| array.is_valid(row).then(|| texts[key].clone())?;
            TableColumn::Texts(keys.map(text).collect::<Vec<Option<String>>>())
        }
        other => {
            let detail = format!(
                "the column `{}` is of type {other}; numbers and texts are read",
                field.name()
            );
            return Err(ArrowError::SchemaError(detail));
        }
    })
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn what_is_written_is_read_again_with_its_gaps() {
        let table = RowTable {
            columns: vec![
                ("row".to_owned(), TableColumn::Integers(vec![7, 8])),
                ("f".to_owned(), TableColumn::Numbers(vec![f64::NAN, 0.1])),
                (
                    "t".to_owned(),
                    TableColumn::Texts(vec![Some("é".to_owned()), None]),
                ),
            ],
        };
        let mut writer = ArrowWriter::new(&table.kinds()).unwrap();
        let mut stream = Vec::new();
        for _ in 0..2 {
            stream.extend(writer.write(table.clone()).unwrap());
        }
        stream.extend(writer.finish().unwrap());
        let tables: Vec<_> = read(Cursor::new(stream)).unwrap().collect();
        assert_eq!(tables.len(), 2);
        for read in tables {
            assert_eq!(format!("{:?}", read.unwrap()), format!("{table:?}"));
        }
        assert!(read(Cursor::new(b"neither".to_vec())).is_err());
    }

    #[test]
    fn damaged_streams_are_errors_whatever_byte_is_wrong() {
        let numbers = TableColumn::Numbers((0..20).map(f64::from).collect());
        let texts = TableColumn::Texts((0..20).map(|k| Some(k.to_string())).collect());
        let table = RowTable {
            columns: vec![("a".to_owned(), numbers), ("b".to_owned(), texts)],
        };
        let mut writer = ArrowWriter::new(&table.kinds()).unwrap();
        let stream = [writer.write(table).unwrap(), writer.finish().unwrap()].concat();
        let mut refused = 0;
        for place in 0..stream.len() {
            for wrong in [[0xff; 4], [0x7f; 4], [0, 0, 0, 0x80]] {
                let mut damaged = stream.clone();
                let end = (place + wrong.len()).min(damaged.len());
                damaged[place..end].copy_from_slice(&wrong[..end - place]);
                let read = read(Cursor::new(damaged));
                refused +=
                    usize::from(!read.is_ok_and(|mut tables| tables.all(|table| table.is_ok())));
            }
        }
        assert!(refused > stream.len() / 2, "{refused}");
    }
}
