//! NPZ: a ZIP archive with one NPY array per name, for `numpy.load`.
//!
//! NPY 1.0 (numpy.lib.format): `\x93NUMPY`, version, length of the header, a Python literal padded with blanks so that the data
//! begin at a multiple of 64 bytes, then the values little-endian in C order. Per cell every array has one axis. On a
//! grid the axes `x_mm` and `y_mm` have one, the values have the shape `(y, x)`.

use std::io::{Cursor, Write};

use zip::result::ZipResult;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::http::render::table::{ArrayData, PLACES, Rows, Table, zone_code};

/// What an NPY header has to be a multiple of, the parts before it included.
const ALIGNMENT: usize = 64;
/// Bytes before the header: mark, version, length.
const BEFORE_HEADER: usize = 10;

/// Writes a table. Zones are `int8`: 0 stick, 1 slip, -1 outside the patch; other values outside are NaN.
///
/// # Errors
/// The archive would be larger than the format allows.
pub fn write(table: &Table) -> ZipResult<Vec<u8>> {
    let mut archive = Archive(ZipWriter::new(Cursor::new(Vec::new())));
    let shape = match &table.rows {
        Rows::Cells { places, strip } => {
            for (name, place) in PLACES.iter().zip(places) {
                archive.add(name, "<f8", &[place.len()], &f64_bytes(place))?;
            }
            let bytes: Vec<u8> = strip.iter().flat_map(|value| value.to_le_bytes()).collect();
            archive.add("strip", "<u4", &[strip.len()], &bytes)?;
            vec![strip.len()]
        }
        Rows::Grid { x_mm, y_mm } => {
            archive.add("x_mm", "<f8", &[x_mm.len()], &f64_bytes(x_mm))?;
            archive.add("y_mm", "<f8", &[y_mm.len()], &f64_bytes(y_mm))?;
            vec![y_mm.len(), x_mm.len()]
        }
    };
    for column in &table.values {
        match &column.data {
            ArrayData::Numbers(values) => {
                archive.add(column.name, "<f8", &shape, &f64_bytes(values))?;
            }
            ArrayData::Zones(zones) => {
                let codes = zones.iter().flat_map(|zone| zone_code(*zone).to_le_bytes());
                let codes: Vec<u8> = codes.collect();
                archive.add(column.name, "|i1", &shape, &codes)?;
            }
        }
    }
    Ok(archive.0.finish()?.into_inner())
}

fn f64_bytes(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Archive {
    fn add(&mut self, name: &str, kind: &str, shape: &[usize], values: &[u8]) -> ZipResult<()> {
        // The time of an entry stays that of the format's epoch: equal fields are equal files.
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(&header(kind, shape))?;
        self.0.write_all(values)?;
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
