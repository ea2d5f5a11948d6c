//! The file of the table: a line of JSON that says what it is, then values at the nodes and bounds of errors.
//!
//! `table.bin` is made by `cargo bench --bench table -- generate` and is part of the program. After the line come two bytes for every
//! value at a node, low byte first, `[a/b][pole][direction][size][ν][function]` in units that the line gives, and one byte for every
//! cell between nodes, `[a/b][pole][direction][size]`. The size 0, linear theory, is left out: there the values are the same everywhere.

use std::sync::LazyLock;

use serde_json::{Value, json};

use crate::rolling::methods::table::evaluate::{CreepTable, SIZE_ROW};
use crate::rolling::methods::table::spline::{
    CELLS, DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLES, RATIOS, ROW, SIZES, VALUES,
};

/// Format of the file.
pub const FORMAT: u64 = 2;
/// The file that is part of the program.
const BYTES: &[u8] = include_bytes!("table.bin");
/// Values in the file: those of all sizes but 0.
const STORED: usize = VALUES / ROW * (ROW - SIZE_ROW);
/// Values at the size 0: no force beside that of linear theory, and everything sticks.
const AT_REST: [f32; OUTPUTS] = [0.0, 0.0, 0.0, 1.0];

/// The table of the program.
static TABLE: LazyLock<CreepTable> = LazyLock::new(|| {
    let file = match TableFile::read(BYTES) {
        Ok(file) => file,
        Err(reason) => unreachable!("the table of this program: {reason}"),
    };
    file.table()
});

/// The table of the program; it is made ready when it is asked for the first time, which takes some hundredths of a second.
pub fn table() -> &'static CreepTable {
    &TABLE
}

/// The contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFile {
    /// Digest of what follows the first line, hexadecimal.
    pub digest: String,
    /// The first line.
    pub head: Value,
    /// Values at the nodes.
    pub values: Vec<f32>,
    /// Bounds of errors of the cells.
    pub bounds: Vec<f32>,
}

impl TableFile {
    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(bytes: &[u8]) -> Result<TableFile, String> {
        let end = bytes.iter().position(|byte| *byte == b'\n');
        let end = end.ok_or("no first line")?;
        let head: Value = serde_json::from_slice(&bytes[..end]).map_err(|e| e.to_string())?;
        if head["format"] != json!(FORMAT) || head["nodes"] != nodes() {
            return Err(format!("another format or other nodes: {head}"));
        }
        let number = |pointer: &str| head.pointer(pointer).and_then(Value::as_f64);
        let (numbers, bounds) = bytes[end + 1..]
            .split_at_checked(2 * STORED)
            .ok_or("too short")?;
        if bounds.len() != CELLS {
            return Err("too short or too long".to_owned());
        }
        let mut units = [0.0_f32; OUTPUTS];
        for (k, unit) in units.iter_mut().enumerate() {
            *unit = number(&format!("/units/{k}")).ok_or("no unit")? as f32;
        }
        let bound_unit = number("/bound_unit").ok_or("no unit of bounds")? as f32;
        let (pairs, _) = numbers.as_chunks::<2>();
        let mut values = Vec::with_capacity(VALUES);
        for row in pairs.chunks_exact(ROW - SIZE_ROW) {
            values.extend(AT_REST.iter().cycle().take(SIZE_ROW));
            let whole = row.iter().map(|pair| f32::from(i16::from_le_bytes(*pair)));
            values.extend(whole.enumerate().map(|(k, v)| v * units[k % OUTPUTS]));
        }
        Ok(TableFile {
            digest: head["digest"].as_str().unwrap_or_default().to_owned(),
            values,
            bounds: bounds
                .iter()
                .map(|byte| bound_unit * f32::from(*byte))
                .collect(),
            head,
        })
    }

    /// The bytes of a file with these values and bounds; `about` says how they were made.
    pub fn write(about: &Value, values: &[f32], bounds: &[f32]) -> Vec<u8> {
        let mut units = [f32::MIN_POSITIVE; OUTPUTS];
        for (k, value) in values.iter().enumerate() {
            units[k % OUTPUTS] = units[k % OUTPUTS].max(value.abs() / f32::from(i16::MAX));
        }
        let largest = bounds.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let bound_unit = largest / f32::from(u8::MAX);
        let rows = values.chunks_exact(ROW).map(|row| &row[SIZE_ROW..]);
        let numbers = rows.flat_map(|row| {
            let numbers = row.iter().enumerate();
            numbers.map(|(k, v)| (v / units[k % OUTPUTS]).round() as i16)
        });
        let mut body: Vec<u8> = numbers.flat_map(i16::to_le_bytes).collect();
        // No bound is rounded down.
        body.extend(
            bounds
                .iter()
                .map(|bound| (bound / bound_unit).ceil().min(255.0) as u8),
        );
        let head = json!({
            "format": FORMAT,
            "digest": blake3::hash(&body).to_hex().to_string(),
            "nodes": nodes(),
            "units": units,
            "bound_unit": bound_unit,
            "about": about,
        });
        let mut bytes = head.to_string().into_bytes();
        bytes.push(b'\n');
        bytes.extend(body);
        bytes
    }

    /// The table of these values.
    pub fn table(&self) -> CreepTable {
        CreepTable::new(&self.values, &self.bounds)
    }
}

/// The nodes in words.
fn nodes() -> Value {
    json!({
        "a_over_b": RATIOS,
        "poles": POLES,
        "directions": DIRECTIONS,
        "sizes_in_48ths": SIZES,
        "poisson_ratios": POISSON_RATIOS,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_at_the_size_0_there_is_linear_theory() {
        let file = TableFile::read(BYTES).expect("the table of the program");
        let bytes = TableFile::write(&json!({}), &file.values, &file.bounds);
        let again = TableFile::read(&bytes).expect("a file");
        let pairs = |one: &[f32], other: &[f32], within: f32| {
            assert_eq!(one.len(), other.len());
            assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() <= within));
        };
        // Units that are found anew round once more.
        pairs(&file.values, &again.values, 1e-4);
        pairs(&file.bounds, &again.bounds, 1e-3);
        for row in again.values.chunks_exact(ROW) {
            assert_eq!(row[..OUTPUTS], AT_REST);
            assert_eq!(row[SIZE_ROW - OUTPUTS..SIZE_ROW], AT_REST);
        }
        // The first number after rest is not one of rest: nothing was shifted.
        assert!(
            file.values
                .chunks_exact(ROW)
                .any(|row| row[SIZE_ROW..][..OUTPUTS] != AT_REST)
        );
    }

    #[test]
    fn the_file_is_not_larger_than_2_megabytes() {
        assert!(BYTES.len() <= 2_000_000, "{}", BYTES.len());
    }
}
