//! Reads and writes NPZ: a ZIP archive with an NPY array per name, as `numpy.savez` writes and `numpy.load` reads it.
//!
//! NPY (numpy.lib.format): `\x93NUMPY`, the version, the length of the header, a Python literal with type and shape, padded with blanks so that
//! the values begin at a multiple of 64 bytes, then the values in C order. Columns of tables have one axis. Values on a grid have the shape
//! `(y, x)`.

use std::io::{Cursor, Read, Write};

use bytes::Bytes;
use railhead_contact::evaluate::answer::RowsAnswer;
use zip::result::ZipResult;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::cells::{CellData, CellRows, CellTable, zone_code};
use crate::csv::{Precision, single};
use crate::error::{Result, faulty, too_large};
use crate::titles::require_few;

/// Description of the accepted types of numbers.
const KINDS: &str = "float32, float64, or integers";

/// Reads the arrays of an archive, which must have equal lengths.
///
/// # Errors
/// `faulty-table` with the name of the array; `body-too-large`: the arrays have more than `max_bytes` bytes.
pub(crate) fn read_arrays(data: Bytes, max_bytes: usize) -> Result<Vec<(String, Vec<f64>)>> {
    let unread =
        |error: &dyn std::fmt::Display| faulty(format!("the NPZ archive cannot be read: {error}"));
    let mut archive = ZipArchive::new(Cursor::new(data)).map_err(|error| unread(&error))?;
    require_few(archive.len())?;
    let mut left = max_bytes as u64;
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for place in 0..archive.len() {
        let file = archive.by_index(place).map_err(|error| unread(&error))?;
        let name = file.name().map_err(|error| unread(&error))?;
        let name = name.trim_end_matches(".npy").to_owned();
        let mut bytes = Vec::new();
        // Reading one byte more than allowed detects a larger array.
        let mut limited = file.take(left + 1);
        limited
            .read_to_end(&mut bytes)
            .map_err(|error| unread(&error))?;
        left = left
            .checked_sub(bytes.len() as u64)
            .ok_or_else(|| too_large(max_bytes))?;
        let values = array(&bytes).map_err(|reason| faulty(format!("array `{name}`: {reason}")))?;
        if let Some((first, others)) = columns.first()
            && others.len() != values.len()
        {
            return Err(faulty(format!(
                "array `{name}` has {} numbers, `{first}` has {}; all need the same",
                values.len(),
                others.len()
            )));
        }
        columns.push((name, values));
    }
    Ok(columns)
}

/// Reads the numbers of an NPY file.
fn array(file: &[u8]) -> Result<Vec<f64>, String> {
    let broken = || "this is not an NPY file".to_owned();
    let rest = file.strip_prefix(b"\x93NUMPY").ok_or_else(broken)?;
    let [version, _, rest @ ..] = rest else {
        return Err(broken());
    };
    let wide = if *version == 1 { 2 } else { 4 };
    let (length, rest) = rest.split_at_checked(wide).ok_or_else(broken)?;
    let bytes = length.iter().rev();
    let length = bytes.fold(0, |sum, byte| (sum << 8) + usize::from(*byte));
    let (header, values) = rest.split_at_checked(length).ok_or_else(broken)?;
    let header = String::from_utf8_lossy(header);
    let after = |key: &str| {
        let place = header.find(key)? + key.len();
        Some(header[place..].trim_start_matches([':', ' ']))
    };
    let kind = after("'descr'")
        .and_then(|text| text.strip_prefix('\''))
        .and_then(|text| text.split_once('\''));
    let Some((kind, _)) = kind else {
        return Err(format!("it holds records; {KINDS} are needed"));
    };
    let shape = after("'shape'")
        .and_then(|text| text.strip_prefix('('))
        .and_then(|text| text.split_once(')'));
    let axes: Vec<&str> = shape.map_or(Vec::new(), |(axes, _)| {
        let axes = axes.split(',').map(str::trim);
        axes.filter(|axis| !axis.is_empty()).collect()
    });
    let [count] = axes[..] else {
        return Err(format!("it has {} axes; one is needed", axes.len()));
    };
    let numbers = decoded(kind, values)
        .ok_or_else(|| format!("it holds values of type `{kind}`; {KINDS} are needed"))?;
    if count.parse() == Ok(numbers.len()) {
        Ok(numbers)
    } else {
        Err(format!(
            "it must have {count} numbers, but has {}",
            numbers.len()
        ))
    }
}

/// Decodes numbers of an NPY type, such as `<f8`.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_lossless,
    reason = "one expression for every type; numbers of a case have 64 bits"
)]
fn decoded(kind: &str, bytes: &[u8]) -> Option<Vec<f64>> {
    macro_rules! numbers {
        ($($little:literal | $big:literal => $type:ty),*) => {
            match kind {
                $($little | $big => {
                    let value = |bytes: &[u8; size_of::<$type>()]| if kind == $big {
                        <$type>::from_be_bytes(*bytes)
                    } else {
                        <$type>::from_le_bytes(*bytes)
                    };
                    let (whole, _) = bytes.as_chunks();
                    whole.iter().map(|bytes| value(bytes) as f64).collect()
                })*
                _ => return None,
            }
        };
    }
    Some(numbers! {
        "<f8" | ">f8" => f64, "<f4" | ">f4" => f32, "<i8" | ">i8" => i64, "<i4" | ">i4" => i32, "<i2" | ">i2" => i16,
        "|i1" | "i1" => i8, "<u8" | ">u8" => u64, "<u4" | ">u4" => u32, "<u2" | ">u2" => u16, "|u1" | "u1" => u8
    })
}

/// The values begin at a multiple of this number of bytes.
const ALIGNMENT: usize = 64;
/// Bytes before the header: magic number, version, length.
const BEFORE_HEADER: usize = 10;

/// Closed polygons, each a list of corners `[x, y]` in mm.
pub type Polygons = Vec<Vec<[f64; 2]>>;

/// Writes a table and its named outlines. For the name `patch`, `outline_patch_mm` has the corners of all polygons, and `outline_patch_start` the
/// index of the first corner of each. Zones are `int8`: 0 stick, 1 slip, -1 outside the patch; other values outside are NaN.
///
/// # Errors
/// The archive is larger than the format allows.
pub fn write(table: &CellTable, outlines: &[(&str, &Polygons)]) -> ZipResult<Vec<u8>> {
    let mut archive = Archive {
        zip: ZipWriter::new(Cursor::new(Vec::new())),
        precision: table.precision,
        method: CompressionMethod::Deflated,
    };
    let shape = match &table.rows {
        CellRows::Cells => vec![table.row_count()],
        CellRows::Grid { x_mm, y_mm } => {
            archive.numbers("x_mm", &[x_mm.len()], x_mm)?;
            archive.numbers("y_mm", &[y_mm.len()], y_mm)?;
            vec![y_mm.len(), x_mm.len()]
        }
    };
    for column in &table.columns {
        match &column.data {
            CellData::Numbers(values) => {
                archive.numbers(column.name, &shape, values)?;
            }
            CellData::Integers(values) => {
                let bytes = values.iter().flat_map(|value| value.to_le_bytes());
                let bytes: Vec<u8> = bytes.collect();
                archive.add(column.name, "<u4", &shape, &bytes)?;
            }
            CellData::Zones(zones) => {
                let codes = zones.iter().flat_map(|zone| zone_code(*zone).to_le_bytes());
                let codes: Vec<u8> = codes.collect();
                archive.add(column.name, "|i1", &shape, &codes)?;
            }
        }
    }
    for (name, polygons) in outlines {
        archive.outline(name, polygons)?;
    }
    Ok(archive.zip.finish()?.into_inner())
}

/// Writes results of rows: an array per column of numbers, NaN if a row has none, and `status` as text.
///
/// # Errors
/// The archive is larger than the format allows.
pub fn write_rows(answer: &RowsAnswer) -> ZipResult<Vec<u8>> {
    let mut archive = Archive {
        zip: ZipWriter::new(Cursor::new(Vec::new())),
        precision: Precision::Double,
        // Computed numbers hardly compress.
        method: CompressionMethod::Stored,
    };
    let rows = answer.status.len();
    for (name, column) in answer.columns() {
        archive.numbers(name, &[rows], column)?;
    }
    let names = answer.status.iter().map(|status| status.name());
    let longest = names.clone().map(str::len).max().unwrap_or(1);
    // Texts of NumPy have four bytes per character, padded with zeros.
    let mut texts = Vec::with_capacity(4 * longest * rows);
    for name in names {
        let begin = texts.len();
        texts.extend(name.chars().flat_map(|c| u32::from(c).to_le_bytes()));
        texts.resize(begin + 4 * longest, 0);
    }
    archive.add("status", &format!("<U{longest}"), &[rows], &texts)?;
    Ok(archive.zip.finish()?.into_inner())
}

struct Archive {
    zip: ZipWriter<Cursor<Vec<u8>>>,
    precision: Precision,
    method: CompressionMethod,
}

impl Archive {
    fn numbers(&mut self, name: &str, shape: &[usize], values: &[f64]) -> ZipResult<()> {
        let values = values.iter();
        match self.precision {
            Precision::Double => {
                let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
                self.add(name, "<f8", shape, &bytes)
            }
            Precision::Single => {
                let bytes = values.flat_map(|value| single(*value).to_le_bytes());
                self.add(name, "<f4", shape, &bytes.collect::<Vec<u8>>())
            }
        }
    }

    /// Adds the corners of all polygons, and the index of the first corner of each.
    fn outline(&mut self, name: &str, polygons: &[Vec<[f64; 2]>]) -> ZipResult<()> {
        let corners: Vec<f64> = polygons.iter().flatten().flatten().copied().collect();
        let shape = [corners.len() / 2, 2];
        self.numbers(&format!("outline_{name}_mm"), &shape, &corners)?;
        let mut starts = Vec::new();
        let mut start = 0_usize;
        for polygon in polygons {
            starts.extend(u32::try_from(start).unwrap_or(u32::MAX).to_le_bytes());
            start += polygon.len();
        }
        self.add(
            &format!("outline_{name}_start"),
            "<u4",
            &[polygons.len()],
            &starts,
        )
    }

    fn add(&mut self, name: &str, kind: &str, shape: &[usize], values: &[u8]) -> ZipResult<()> {
        // Entries have the default time, so that equal fields give equal files.
        let options = SimpleFileOptions::default().compression_method(self.method);
        self.zip.start_file(format!("{name}.npy"), options)?;
        self.zip.write_all(&npy_header(kind, shape))?;
        self.zip.write_all(values)?;
        Ok(())
    }
}

/// Returns the bytes of an NPY file before its values.
fn npy_header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let axes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    // A Python tuple with one element ends in a comma.
    let comma = if axes.len() == 1 { "," } else { "" };
    let mut literal = format!(
        "{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}{comma}), }}",
        axes.join(", ")
    );
    let used = BEFORE_HEADER + literal.len() + 1;
    let padding = used.next_multiple_of(ALIGNMENT) - used;
    literal.push_str(&" ".repeat(padding));
    literal.push('\n');
    let length = u16::try_from(literal.len()).unwrap_or(u16::MAX);
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(literal.as_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, values: &[u8]) -> Vec<u8> {
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
        file.extend(header.as_bytes());
        file.extend(values);
        file
    }

    #[test]
    fn numbers_of_every_type_and_order_are_read() {
        let header = |kind: &str| {
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': (2,), }}\n")
        };
        let little: Vec<u8> = [1.5_f64, -2.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let big: Vec<u8> = [1.5_f64, -2.0]
            .iter()
            .flat_map(|v| v.to_be_bytes())
            .collect();
        let short: Vec<u8> = [1.5_f32, -2.0]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let whole: Vec<u8> = [3_i16, -2].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(array(&file(&header("<f8"), &little)), Ok(vec![1.5, -2.0]));
        assert_eq!(array(&file(&header(">f8"), &big)), Ok(vec![1.5, -2.0]));
        assert_eq!(array(&file(&header("<f4"), &short)), Ok(vec![1.5, -2.0]));
        assert_eq!(array(&file(&header("<i2"), &whole)), Ok(vec![3.0, -2.0]));
        assert_eq!(
            array(&file(&header("|u1"), &[7, 255])),
            Ok(vec![7.0, 255.0])
        );
    }

    #[test]
    fn what_is_no_column_of_numbers_is_named() {
        let header = |kind: &str, shape: &str| format!("{{'descr': {kind}, 'shape': {shape}, }}\n");
        for (header, values, expected) in [
            (header("'<f8'", "(2, 2)"), 32, "2 axes"),
            (header("'<f8'", "()"), 8, "0 axes"),
            (header("'<U3'", "(2,)"), 24, "type `<U3`"),
            (header("[('a', '<f8')]", "(2,)"), 16, "records"),
            (
                header("'<f8'", "(3,)"),
                16,
                "must have 3 numbers, but has 2",
            ),
        ] {
            let told = array(&file(&header, &vec![0; values])).unwrap_err();
            assert!(told.contains(expected), "{told}");
        }
        for broken in [&b""[..], b"\x93NUMPY", b"\x93NUMPY\x01\x00\xff\xff{"] {
            assert!(array(broken).is_err());
        }
    }

    #[test]
    fn values_begin_at_a_multiple_of_64_bytes() {
        for shape in [&[0][..], &[1], &[12_345], &[3, 4], &[1000, 1000]] {
            let header = npy_header("<f8", shape);
            assert_eq!(header.len() % ALIGNMENT, 0, "{shape:?}");
            let length = u16::from_le_bytes([header[8], header[9]]);
            assert_eq!(header.len(), BEFORE_HEADER + usize::from(length));
            assert!(header.ends_with(b"\n"));
        }
        let one = String::from_utf8_lossy(&npy_header("<u4", &[7])[BEFORE_HEADER..]).into_owned();
        assert!(one.contains("'shape': (7,), }"), "{one}");
    }
}
