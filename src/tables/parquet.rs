//! Reads and writes tables of rows as Parquet, which is also the format of stored rows of runs.
//!
//! Columns are flat. Missing numbers and texts are null.

use std::sync::Arc;

use parquet::basic::{
    Compression, CompressionCodec, ConvertedType, LogicalType, Repetition, Type as Physical,
};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{
    ByteArray, ByteArrayType, DataType, DoubleType, FixedLenByteArrayType, FloatType, Int32Type,
    Int64Type,
};
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use crate::table::{RowTable, TableColumn, TableKind};
use crate::{DAMAGED, guarded};

/// Most rows of a row group; common writers make groups of 10⁵ or 10⁶ rows.
const GROUP_ROWS_MAX: usize = 1 << 21;
/// Most values of a row group, over all columns. A few bytes of a file can encode one value for all rows.
const GROUP_VALUES_MAX: usize = 1 << 24;
/// Most bytes of the texts of a column of a row group.
const TEXT_BYTES_MAX: usize = 1 << 27;

/// The accepted codecs. GZIP and Brotli are not accepted, because the library does not limit the size of a decompressed page.
const CODECS: [CompressionCodec; 4] = [
    CompressionCodec::UNCOMPRESSED,
    CompressionCodec::SNAPPY,
    CompressionCodec::ZSTD,
    CompressionCodec::LZ4_RAW,
];

/// The first and last bytes of a file.
pub const MAGIC: &[u8] = b"PAR1";

/// Writes tables with equal columns, with a row group per table.
pub struct TableWriter(SerializedFileWriter<Vec<u8>>);

impl TableWriter {
    /// Begins a file with these columns.
    ///
    /// # Errors
    /// Writing fails.
    pub fn new(columns: &[(String, TableKind)]) -> Result<TableWriter> {
        let fields = columns.iter().map(|(name, kind)| field(name, *kind));
        let schema = Type::group_type_builder("rows")
            .with_fields(fields.collect::<Result<_>>()?)
            .build()?;
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_created_by(concat!("railhead version ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_statistics_enabled(EnabledStatistics::Chunk);
        for (name, kind) in columns {
            if *kind == TableKind::Texts {
                properties = properties.set_column_dictionary_enabled(name.as_str().into(), true);
            }
        }
        let properties = Arc::new(properties.build());
        Ok(TableWriter(SerializedFileWriter::new(
            Vec::new(),
            Arc::new(schema),
            properties,
        )?))
    }

    /// Returns the bytes of a table as a row group; the first bytes of the file precede those of the first table.
    ///
    /// # Errors
    /// The table has other columns, or writing fails.
    pub fn write(&mut self, table: &RowTable) -> Result<Vec<u8>> {
        let mut group = self.0.next_row_group()?;
        for (_, column) in &table.columns {
            let Some(mut writer) = group.next_column()? else {
                return Err(ParquetError::General("a column too many".to_owned()));
            };
            match column {
                TableColumn::Integers(values) => {
                    writer
                        .typed::<Int64Type>()
                        .write_batch(values, None, None)?;
                }
                TableColumn::Numbers(values) => {
                    let there = |value: &&f64| !value.is_nan();
                    let levels: Vec<i16> = values.iter().map(|v| i16::from(!v.is_nan())).collect();
                    let values: Vec<f64> = values.iter().filter(there).copied().collect();
                    let typed = writer.typed::<DoubleType>();
                    typed.write_batch(&values, Some(&levels), None)?;
                }
                TableColumn::Texts(values) => {
                    let levels = values.iter().map(|text| i16::from(text.is_some()));
                    let levels: Vec<i16> = levels.collect();
                    let values = values.iter().flatten();
                    let values: Vec<ByteArray> = values.map(|text| text.as_str().into()).collect();
                    let typed = writer.typed::<ByteArrayType>();
                    typed.write_batch(&values, Some(&levels), None)?;
                }
            }
            writer.close()?;
        }
        group.close()?;
        Ok(std::mem::take(self.0.inner_mut()))
    }

    /// Returns the end of the file.
    ///
    /// # Errors
    /// Writing fails.
    pub fn finish(&mut self) -> Result<Vec<u8>> {
        self.0.finish()?;
        Ok(std::mem::take(self.0.inner_mut()))
    }
}

fn field(name: &str, kind: TableKind) -> Result<Arc<Type>> {
    let (physical, repetition) = match kind {
        TableKind::Integers => (Physical::INT64, Repetition::REQUIRED),
        TableKind::Numbers => (Physical::DOUBLE, Repetition::OPTIONAL),
        TableKind::Texts => (Physical::BYTE_ARRAY, Repetition::OPTIONAL),
    };
    let mut field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
    if kind == TableKind::Texts {
        field = field.with_converted_type(ConvertedType::UTF8);
    }
    field.build().map(Arc::new)
}

/// Returns a file with one table.
///
/// # Errors
/// Writing fails.
pub fn encode(table: &RowTable) -> Result<Vec<u8>> {
    let mut writer = TableWriter::new(&table.kinds())?;
    Ok([writer.write(table)?, writer.finish()?].concat())
}

/// Reads a file with flat columns.
pub struct TableReader<R: ChunkReader + 'static>(SerializedFileReader<R>);

impl<R: ChunkReader + 'static> TableReader<R> {
    /// Opens a file.
    ///
    /// # Errors
    /// The file is not a Parquet file.
    pub fn new(file: R) -> Result<TableReader<R>> {
        let opened = guarded(|| SerializedFileReader::new(file));
        opened.unwrap_or_else(|| Err(damaged())).map(TableReader)
    }

    /// Returns the number of row groups.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.0.num_row_groups()
    }

    /// Returns the number of rows of a row group, and its decompressed size in bytes.
    #[must_use]
    pub fn group_size(&self, group: usize) -> (i64, i64) {
        let about = self.0.metadata().row_group(group);
        (about.num_rows(), about.total_byte_size())
    }

    /// Returns the names of the columns.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let schema = self.0.metadata().file_metadata().schema_descr();
        let columns = schema.columns().iter();
        columns.map(|column| column.path().string()).collect()
    }

    /// Reads the columns of a row group whose names `wanted` accepts, in the order of the file.
    ///
    /// # Errors
    /// A column is neither of numbers nor of texts, or is nested, or cannot be read.
    pub fn read(&self, group: usize, wanted: impl Fn(&str) -> bool) -> Result<RowTable> {
        guarded(|| self.read_group(group, wanted)).unwrap_or_else(|| Err(damaged()))
    }

    fn read_group(&self, group: usize, wanted: impl Fn(&str) -> bool) -> Result<RowTable> {
        let group = self.0.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let names = self.names();
        if rows > GROUP_ROWS_MAX || rows * names.len() > GROUP_VALUES_MAX {
            let detail = format!(
                "a group of {rows} rows in {} columns; at most {GROUP_ROWS_MAX} rows and {GROUP_VALUES_MAX} values are read at once, \
                 write smaller groups",
                names.len()
            );
            return Err(ParquetError::General(detail));
        }
        let mut columns = Vec::new();
        for (place, name) in names.into_iter().enumerate() {
            if !wanted(&name) {
                continue;
            }
            let codec = group.metadata().column(place).compression_codec();
            if !CODECS.contains(&codec) {
                let allowed = CODECS.map(|codec| codec.to_string()).join(", ");
                let detail =
                    format!("the column `{name}` is compressed with {codec}; allowed: {allowed}");
                return Err(ParquetError::General(detail));
            }
            let meaning = Meaning::of(&group.metadata().column(place).column_descr_ptr())?;
            let column = match group.get_column_reader(place)? {
                ColumnReader::Int64ColumnReader(reader) => match meaning {
                    Meaning::Plain => integers(reader, rows)?,
                    meaning => {
                        let values = read::<Int64Type>(reader, rows)?;
                        numbers(values, |value| meaning.number(value.into(), 64))
                    }
                },
                ColumnReader::Int32ColumnReader(reader) => {
                    let values = read::<Int32Type>(reader, rows)?;
                    numbers(values, |value| meaning.number(value.into(), 32))
                }
                ColumnReader::FixedLenByteArrayColumnReader(reader)
                    if matches!(meaning, Meaning::Decimal(_)) =>
                {
                    let values = read::<FixedLenByteArrayType>(reader, rows)?;
                    numbers(values, |value| meaning.decimal(value.data()))
                }
                ColumnReader::ByteArrayColumnReader(reader)
                    if matches!(meaning, Meaning::Decimal(_)) =>
                {
                    let values = read::<ByteArrayType>(reader, rows)?;
                    numbers(values, |value| meaning.decimal(value.data()))
                }
                ColumnReader::FloatColumnReader(reader) => {
                    numbers(read::<FloatType>(reader, rows)?, f64::from)
                }
                ColumnReader::DoubleColumnReader(reader) => {
                    numbers(read::<DoubleType>(reader, rows)?, |value| value)
                }
                ColumnReader::ByteArrayColumnReader(reader) => texts(reader, rows)?,
                _ => {
                    let detail = format!("the column `{name}` holds neither numbers nor texts");
                    return Err(ParquetError::General(detail));
                }
            };
            if column.len() != rows {
                let detail = format!("the column `{name}` is nested; columns must be flat");
                return Err(ParquetError::General(detail));
            }
            columns.push((name, column));
        }
        Ok(RowTable { columns })
    }
}

/// The meaning of the stored values of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    /// The stored values.
    Plain,
    /// Unsigned integers.
    Unsigned,
    /// Integers that are divided by this power of ten.
    Decimal(i32),
}

impl Meaning {
    /// Returns the meaning by the logical type of a column.
    ///
    /// # Errors
    /// The column holds dates or times.
    fn of(column: &ColumnDescriptor) -> Result<Meaning> {
        use ConvertedType as Old;
        let logical = column.logical_type_ref();
        match (logical, column.converted_type()) {
            (Some(LogicalType::Decimal(_)), _) | (_, Old::DECIMAL) => {
                Ok(Meaning::Decimal(column.type_scale()))
            }
            (_, Old::UINT_8 | Old::UINT_16 | Old::UINT_32 | Old::UINT_64) => Ok(Meaning::Unsigned),
            (Some(LogicalType::Integer(integer)), _) if !integer.is_signed => Ok(Meaning::Unsigned),
            (Some(LogicalType::Date | LogicalType::Time(_) | LogicalType::Timestamp(_)), _)
            | (
                _,
                Old::DATE
                | Old::TIME_MILLIS
                | Old::TIME_MICROS
                | Old::TIMESTAMP_MILLIS
                | Old::TIMESTAMP_MICROS,
            ) => {
                let detail = format!(
                    "the column `{}` holds dates or times; write them as texts or as numbers",
                    column.path().string()
                );
                Err(ParquetError::General(detail))
            }
            _ => Ok(Meaning::Plain),
        }
    }

    /// Converts a stored integer of this many bits.
    #[expect(clippy::cast_precision_loss, reason = "numbers of a case have 64 bits")]
    fn number(self, stored: i128, bits: u32) -> f64 {
        match self {
            Meaning::Plain => stored as f64,
            Meaning::Unsigned => stored.rem_euclid(1 << bits) as f64,
            Meaning::Decimal(scale) => stored as f64 / 10_f64.powi(scale),
        }
    }

    /// Converts a big-endian decimal in two's complement.
    fn decimal(self, bytes: &[u8]) -> f64 {
        let Some(first) = bytes.first().filter(|_| bytes.len() <= size_of::<i128>()) else {
            return f64::NAN;
        };
        let start = if *first < 0x80 { 0 } else { -1 };
        let stored = bytes
            .iter()
            .fold(start, |sum: i128, byte| (sum << 8) | i128::from(*byte));
        self.number(stored, 128)
    }
}

fn damaged() -> ParquetError {
    ParquetError::General(DAMAGED.to_owned())
}

/// Reads the values of a column; `None` for null.
fn read<T: DataType>(mut reader: ColumnReaderImpl<T>, rows: usize) -> Result<Vec<Option<T::T>>> {
    let (mut values, mut levels) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    let mut repeated = Vec::new();
    let mut read = 0;
    while read < rows {
        let (records, _, _) = reader.read_records(
            rows - read,
            Some(&mut levels),
            Some(&mut repeated),
            &mut values,
        )?;
        if records == 0 {
            break;
        }
        read += records;
    }
    if levels.is_empty() {
        return Ok(values.into_iter().map(Some).collect());
    }
    let mut values = values.into_iter();
    let value = |level: i16| if level > 0 { values.next() } else { None };
    Ok(levels.into_iter().map(value).collect())
}

fn numbers<T>(values: Vec<Option<T>>, number: impl Fn(T) -> f64) -> TableColumn {
    let number = |value: Option<T>| value.map_or(f64::NAN, &number);
    TableColumn::Numbers(values.into_iter().map(number).collect())
}

/// Reads integers; a column with nulls becomes one of numbers.
fn integers(reader: ColumnReaderImpl<Int64Type>, rows: usize) -> Result<TableColumn> {
    let values = read::<Int64Type>(reader, rows)?;
    Ok(match values.iter().copied().collect::<Option<Vec<i64>>>() {
        Some(all) => TableColumn::Integers(all),
        #[expect(clippy::cast_precision_loss, reason = "numbers of a case have 64 bits")]
        None => numbers(values, |value| value as f64),
    })
}

fn texts(reader: ColumnReaderImpl<ByteArrayType>, rows: usize) -> Result<TableColumn> {
    let values = read::<ByteArrayType>(reader, rows)?;
    let bytes: usize = values.iter().flatten().map(ByteArray::len).sum();
    if bytes > TEXT_BYTES_MAX {
        let detail = format!(
            "a column of texts of {bytes} bytes; at most {TEXT_BYTES_MAX} are read at once, write smaller groups"
        );
        return Err(ParquetError::General(detail));
    }
    let text = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
    let texts = values.into_iter().map(|value| value.map(text).transpose());
    texts.collect::<Result<_>>().map(TableColumn::Texts)
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use parquet::basic::{TimeUnit, ZstdLevel};
    use parquet::schema::types::PrimitiveTypeBuilder;

    use super::*;

    fn table() -> RowTable {
        RowTable {
            columns: vec![
                ("row".to_owned(), TableColumn::Integers(vec![7, 8, 9])),
                (
                    "force_x_n".to_owned(),
                    TableColumn::Numbers(vec![0.1, f64::NAN, -1e300]),
                ),
                (
                    "/a~1b".to_owned(),
                    TableColumn::Texts(vec![Some("é".to_owned()), None, Some(String::new())]),
                ),
            ],
        }
    }

    #[test]
    fn what_is_written_is_read_again_with_its_gaps() {
        let file = encode(&table()).unwrap();
        assert!(file.starts_with(MAGIC) && file.ends_with(MAGIC));
        let reader = TableReader::new(Bytes::from(file)).unwrap();
        assert_eq!((reader.groups(), reader.group_size(0).0), (1, 3));
        let read = reader.read(0, |_| true).unwrap();
        assert_eq!(format!("{read:?}"), format!("{:?}", table()));
        let one = reader.read(0, |name| name == "row").unwrap();
        assert_eq!(one.columns, table().columns[..1]);
    }

    /// A file with one column of this physical type, made by the library.
    fn column<T: DataType>(
        kind: Physical,
        with: impl FnOnce(PrimitiveTypeBuilder<'static>) -> PrimitiveTypeBuilder<'static>,
        codec: Compression,
        values: &[T::T],
    ) -> Result<TableColumn> {
        let field = with(Type::primitive_type_builder("x", kind));
        let field = field.with_repetition(Repetition::REQUIRED).build()?;
        let schema = Type::group_type_builder("rows").with_fields(vec![Arc::new(field)]);
        let mut file = Vec::new();
        let properties = WriterProperties::builder().set_compression(codec).build();
        let mut writer =
            SerializedFileWriter::new(&mut file, Arc::new(schema.build()?), Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        let mut column = group.next_column()?.expect("one column");
        column.typed::<T>().write_batch(values, None, None)?;
        column.close()?;
        group.close()?;
        writer.close()?;
        let table = TableReader::new(Bytes::from(file))?.read(0, |_| true)?;
        Ok(table.columns[0].1.clone())
    }

    #[test]
    fn logical_types_are_the_numbers_that_they_mean() {
        use ConvertedType as Old;
        let plain = Compression::UNCOMPRESSED;
        let decimal = |field: PrimitiveTypeBuilder<'static>| {
            let field = field.with_converted_type(Old::DECIMAL);
            field.with_precision(9).with_scale(3)
        };
        let read = column::<Int32Type>(Physical::INT32, decimal, plain, &[1, -80_000]);
        assert_eq!(read.unwrap(), TableColumn::Numbers(vec![0.001, -80.0]));
        let read = column::<Int64Type>(Physical::INT64, decimal, plain, &[2500]);
        assert_eq!(read.unwrap(), TableColumn::Numbers(vec![2.5]));
        let bytes = [vec![0x01, 0xf4], vec![0xff, 0xff, 0xfe]].map(ByteArray::from);
        let read = column::<ByteArrayType>(Physical::BYTE_ARRAY, decimal, plain, &bytes);
        assert_eq!(read.unwrap(), TableColumn::Numbers(vec![0.5, -0.002]));
        let unsigned =
            |field: PrimitiveTypeBuilder<'static>| field.with_converted_type(Old::UINT_32);
        let read = column::<Int32Type>(Physical::INT32, unsigned, plain, &[-1_294_967_296]);
        assert_eq!(read.unwrap(), TableColumn::Numbers(vec![3e9]));
        let unsigned =
            |field: PrimitiveTypeBuilder<'static>| field.with_converted_type(Old::UINT_64);
        let read = column::<Int64Type>(Physical::INT64, unsigned, plain, &[-1]);
        assert_eq!(read.unwrap(), TableColumn::Numbers(vec![2_f64.powi(64)]));
        for time in [
            LogicalType::Date,
            LogicalType::timestamp(true, TimeUnit::NANOS),
        ] {
            let kind = match time {
                LogicalType::Date => Physical::INT32,
                _ => Physical::INT64,
            };
            let with = |field: PrimitiveTypeBuilder<'static>| field.with_logical_type(Some(time));
            let read = match kind {
                Physical::INT32 => column::<Int32Type>(kind, with, plain, &[20_000]),
                _ => column::<Int64Type>(kind, with, plain, &[1 << 60]),
            };
            let told = read.unwrap_err().to_string();
            assert!(told.contains("`x` holds dates or times"), "{told}");
        }
    }

    #[test]
    fn files_are_read_with_every_codec_that_is_allowed() {
        for codec in [
            Compression::UNCOMPRESSED,
            Compression::SNAPPY,
            Compression::ZSTD(ZstdLevel::default()),
            Compression::LZ4_RAW,
        ] {
            let read = column::<DoubleType>(Physical::DOUBLE, |field| field, codec, &[0.5; 100]);
            assert_eq!(
                read.unwrap(),
                TableColumn::Numbers(vec![0.5; 100]),
                "{codec}"
            );
        }
    }

    #[test]
    fn several_tables_are_groups_of_one_file() {
        let mut writer = TableWriter::new(&table().kinds()).unwrap();
        let mut file = Vec::new();
        for _ in 0..2 {
            file.extend(writer.write(&table()).unwrap());
        }
        file.extend(writer.finish().unwrap());
        let reader = TableReader::new(Bytes::from(file)).unwrap();
        assert_eq!(reader.groups(), 2);
        let cut = reader.read(1, |_| true).unwrap().cut(&(2..3));
        assert_eq!((cut.row_count(), cut.columns.len()), (1, 3));
        assert!(TableReader::new(Bytes::from_static(b"PAR1 is no file")).is_err());
    }

    #[test]
    fn groups_that_unpack_to_far_more_than_they_say_are_refused() {
        let rows = GROUP_ROWS_MAX + 1;
        let constant = TableColumn::Numbers(vec![1.0; rows]);
        let long = RowTable {
            columns: vec![("x".to_owned(), constant)],
        };
        let reader = TableReader::new(Bytes::from(encode(&long).unwrap())).unwrap();
        let refused = reader.read(0, |_| true).unwrap_err().to_string();
        assert!(refused.contains("smaller groups"), "{refused}");
        // One text in all rows takes a few bytes.
        let text = "a".repeat(1 << 16);
        let texts = RowTable {
            columns: vec![("t".to_owned(), TableColumn::Texts(vec![Some(text); 3000]))],
        };
        let file = encode(&texts).unwrap();
        assert!(file.len() < 1 << 17, "{}", file.len());
        let reader = TableReader::new(Bytes::from(file)).unwrap();
        let refused = reader.read(0, |_| true).unwrap_err().to_string();
        assert!(refused.contains("column of texts"), "{refused}");
    }

    /// A size that a file states may be anything. An allocation that fails would end the process, a panic of the library is an error.
    #[test]
    fn damaged_files_are_errors_whatever_byte_is_wrong() {
        let file = encode(&table()).unwrap();
        let mut read = 0;
        for place in 0..file.len() {
            for wrong in [[0xff; 5], [0x7f; 5], [0xff, 0xff, 0xff, 0xff, 0x0f]] {
                let mut damaged = file.clone();
                let end = (place + wrong.len()).min(damaged.len());
                damaged[place..end].copy_from_slice(&wrong[..end - place]);
                let Ok(reader) = TableReader::new(Bytes::from(damaged)) else {
                    continue;
                };
                let groups = 0..reader.groups().min(3);
                let looked = groups
                    .map(|group| reader.read(group, |_| true))
                    .find(Result::is_ok);
                read += usize::from(looked.is_some());
            }
        }
        // Most bytes matter, those of statistics and values do not.
        assert!(read < 2 * file.len(), "{read} of {}", 3 * file.len());
    }
}
