//! Tables of values per cell of a mesh, or on a grid of samples.

use railhead_contact::solution::words::answer::Zone;

use crate::csv::{Precision, write_number};

/// Named columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct CellTable {
    /// Cells, or samples of a grid.
    pub rows: CellRows,
    /// The columns, without the axes of a grid.
    pub columns: Vec<CellColumn>,
    /// Precision of written numbers.
    pub precision: Precision,
}

impl CellTable {
    /// Returns the number of rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        match &self.rows {
            CellRows::Cells => self.numbers(PLACES[0]).map_or(0, <[f64]>::len),
            CellRows::Grid { x_mm, y_mm } => x_mm.len() * y_mm.len(),
        }
    }

    /// Returns the names of the columns, the axes of a grid first.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        let axes: &[&str] = match self.rows {
            CellRows::Cells => &[],
            CellRows::Grid { .. } => &PLACES[..2],
        };
        let columns = self.columns.iter().map(|column| column.name);
        axes.iter().copied().chain(columns).collect()
    }

    /// Returns the index of the value of a row in a column of [`CellTable::names`].
    pub fn index(&self, column: usize, row: usize) -> usize {
        match (&self.rows, column) {
            (CellRows::Grid { x_mm, .. }, 0) => row % x_mm.len(),
            (CellRows::Grid { x_mm, .. }, 1) => row / x_mm.len(),
            _ => row,
        }
    }

    /// Appends a value of a column of [`CellTable::names`]: `none` for a missing value, a zone between two `quote`.
    pub fn write(&self, out: &mut String, column: usize, index: usize, [none, quote]: [&str; 2]) {
        let place = match (&self.rows, column) {
            (CellRows::Grid { x_mm, .. }, 0) => {
                return write_number(out, x_mm[index], self.precision, none);
            }
            (CellRows::Grid { y_mm, .. }, 1) => {
                return write_number(out, y_mm[index], self.precision, none);
            }
            (CellRows::Grid { .. }, place) => place - 2,
            (CellRows::Cells, place) => place,
        };
        match &self.columns[place].data {
            CellData::Numbers(values) => write_number(out, values[index], self.precision, none),
            CellData::Integers(values) => *out += &values[index].to_string(),
            CellData::Zones(zones) => match zones[index] {
                Some(zone) => *out += &format!("{quote}{}{quote}", zone.name()),
                None => *out += none,
            },
        }
    }

    /// Returns the size in memory in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.row_count() * self.columns.len() * size_of::<f64>()
    }

    /// Returns the numbers of a column.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find_map(|column| match &column.data {
            CellData::Numbers(values) if column.name == name => Some(&**values),
            _ => None,
        })
    }
}

/// The rows of a table: cells of a mesh, or samples of a grid.
#[derive(Debug, Clone, PartialEq)]
pub enum CellRows {
    /// One row per cell. The columns [`PLACES`] and `strip` give its position.
    Cells,
    /// One row per sample of a regular grid, x running fastest.
    Grid {
        /// Samples along x in mm, ascending.
        x_mm: Vec<f64>,
        /// Samples along y in mm, ascending.
        y_mm: Vec<f64>,
    },
}

/// The columns with centre and width of a cell.
pub const PLACES: [&str; 4] = ["x_mm", "y_mm", "dx_mm", "dy_mm"];

/// A column with a value per row.
#[derive(Debug, Clone, PartialEq)]
pub struct CellColumn {
    /// The name, equal in all formats.
    pub name: &'static str,
    /// The values.
    pub data: CellData,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum CellData {
    /// Numbers; NaN outside the patch.
    Numbers(Vec<f64>),
    /// Whole numbers.
    Integers(Vec<u32>),
    /// Zones; `None` outside the patch.
    Zones(Vec<Option<Zone>>),
}

/// Returns the code of a zone in formats without words: 0 stick, 1 slip, -1 outside the patch.
#[must_use]
pub fn zone_code(zone: Option<Zone>) -> i8 {
    match zone {
        Some(Zone::Stick) => 0,
        Some(Zone::Slip) => 1,
        None => -1,
    }
}
