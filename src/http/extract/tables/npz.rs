//! Reads columns of numbers from an NPZ archive, as `numpy.savez` writes it: one NPY array with one axis per column.
//!
//! NPY (numpy.lib.format): `\x93NUMPY`, the version, the length of the header, a Python literal with type and shape, then the values.

use std::io::{Cursor, Read};

use axum::body::Bytes;
use zip::ZipArchive;

use crate::extract::titles::{faulty, require_few};
use crate::problem::{ApiError, ProblemKind, Result};

/// What an array may hold.
const KINDS: &str = "float32, float64, or integers";

/// The arrays of an archive with their names, all of one length.
///
/// # Errors
/// `faulty-table` with the array; `body-too-large`: unpacked they have more than `max_bytes`.
pub(super) fn read_arrays(data: Bytes, max_bytes: usize) -> Result<Vec<(String, Vec<f64>)>> {
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
        // One byte more than is allowed tells that there is more.
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

/// The refusal of an archive that is larger than this, packed or unpacked.
#[must_use]
pub fn too_large(max_bytes: usize) -> ApiError {
    let detail = format!(
        "the arrays are larger than the {max_bytes} bytes that are allowed (`--evaluate-max-mib`)"
    );
    ApiError::new(ProblemKind::BodyTooLarge, detail)
}

/// The numbers of an NPY file.
fn array(file: &[u8]) -> Result<Vec<f64>, String> {
    let broken = || "this is not an NPY file".to_owned();
    let rest = file.strip_prefix(b"\x93NUMPY").ok_or_else(broken)?;
    let [version, _, rest @ ..] = rest else {
        return Err(broken());
    };
    let wide = if *version == 1 { 2 } else { 4 };
    let (length, rest) = rest.split_at_checked(wide).ok_or_else(broken)?;
    let length = length
        .iter()
        .rev()
        .fold(0_usize, |sum, byte| (sum << 8) + usize::from(*byte));
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

/// Numbers of an NPY type, such as `<f8`.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_lossless,
    reason = "one expression for every type; as every number of a case"
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
}
