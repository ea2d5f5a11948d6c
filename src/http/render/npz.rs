//! NPZ: a ZIP archive with one NPY array per name, for `numpy.load`.
//!
//! NPY 1.0 (numpy.lib.format): `\x93NUMPY`, version, length of the header, a Python literal padded with blanks so that the data
//! begin at a multiple of 64 bytes, then the values little-endian in C order. Per cell every array has one axis. On a
//! grid the axes `x_mm` and `y_mm` have one, the values have the shape `(y, x)`.

use std::io::{Cursor, Write};

use zip::result::ZipResult;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::dto::Outlines;
use crate::render::csv::{Precision, single};
use crate::render::table::{ArrayData, Rows, Table, zone_code};
use railhead_contact::evaluate::answer::RowsAnswer;

/// What an NPY header has to be a multiple of, the parts before it included.
const ALIGNMENT: usize = 64;
/// Bytes before the header: mark, version, length.
const BEFORE_HEADER: usize = 10;

/// Writes a table and its outlines: `outline_patch_mm` has the corners of all polygons around the patch, `outline_patch_start` the place of
/// the first corner of each, and so for `stick` and `slip`. Zones are `int8`: 0 stick, 1 slip, -1 outside the patch; other values outside are NaN.
///
/// # Errors
/// The archive would be larger than the format allows.
pub(crate) fn write(table: &Table, outlines: &Outlines) -> ZipResult<Vec<u8>> {
    let mut archive = Archive {
        zip: ZipWriter::new(Cursor::new(Vec::new())),
        precision: table.precision,
        method: CompressionMethod::Deflated,
    };
    let shape = match &table.rows {
        Rows::Cells => vec![table.len()],
        Rows::Grid { x_mm, y_mm } => {
            archive.numbers("x_mm", &[x_mm.len()], x_mm)?;
            archive.numbers("y_mm", &[y_mm.len()], y_mm)?;
            vec![y_mm.len(), x_mm.len()]
        }
    };
    for column in &table.columns {
        match &column.data {
            ArrayData::Numbers(values) => {
                archive.numbers(column.name, &shape, values)?;
            }
            ArrayData::Integers(values) => {
                let bytes = values.iter().flat_map(|value| value.to_le_bytes());
                let bytes: Vec<u8> = bytes.collect();
                archive.add(column.name, "<u4", &shape, &bytes)?;
            }
            ArrayData::Zones(zones) => {
                let codes = zones.iter().flat_map(|zone| zone_code(*zone).to_le_bytes());
                let codes: Vec<u8> = codes.collect();
                archive.add(column.name, "|i1", &shape, &codes)?;
            }
        }
    }
    archive.outline("patch", &outlines.patch)?;
    let zones = [("stick", &outlines.stick), ("slip", &outlines.slip)];
    for (name, polygons) in zones {
        if let Some(polygons) = polygons {
            archive.outline(name, polygons)?;
        }
    }
    Ok(archive.zip.finish()?.into_inner())
}

/// Writes answers to rows: an array for each column of numbers, NaN where a row has none, and `status` as text.
///
/// # Errors
/// The archive would be larger than the format allows.
pub(crate) fn write_rows(answer: &RowsAnswer) -> ZipResult<Vec<u8>> {
    let mut archive = Archive {
        zip: ZipWriter::new(Cursor::new(Vec::new())),
        precision: Precision::Double,
        // Digits of measured forces do not pack.
        method: CompressionMethod::Stored,
    };
    let rows = answer.status.len();
    for (name, column) in answer.columns() {
        archive.numbers(name, &[rows], column)?;
    }
    let names = answer.status.iter().map(|status| status.name());
    let longest = names.clone().map(str::len).max().unwrap_or(1);
    // NumPy's text: four bytes for each character, filled up with zeros.
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

    /// The corners of all polygons, and the place of the first corner of each.
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
        // The time of an entry stays that of the format's epoch: equal fields are equal files.
        let options = SimpleFileOptions::default().compression_method(self.method);
        self.zip.start_file(format!("{name}.npy"), options)?;
        self.zip.write_all(&header(kind, shape))?;
        self.zip.write_all(values)?;
        Ok(())
    }
}

/// Everything of an NPY file before its values.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let axes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    // A Python tuple of one needs its comma.
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

    #[test]
    fn values_begin_at_a_multiple_of_64_bytes() {
        for shape in [&[0][..], &[1], &[12_345], &[3, 4], &[1000, 1000]] {
            let header = header("<f8", shape);
            assert_eq!(header.len() % ALIGNMENT, 0, "{shape:?}");
            let length = u16::from_le_bytes([header[8], header[9]]);
            assert_eq!(header.len(), BEFORE_HEADER + usize::from(length));
            assert!(header.ends_with(b"\n"));
        }
        let one = String::from_utf8_lossy(&header("<u4", &[7])[BEFORE_HEADER..]).into_owned();
        assert!(one.contains("'shape': (7,), }"), "{one}");
    }
}
