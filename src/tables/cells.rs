//! Values per cell of a mesh, or on a grid of samples, as columns.

use railhead_contact::solution::words::answer::Zone;

use crate::csv::{Precision, write_number};

/// Named columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct CellTable {
    /// Whether a row is a cell or a sample of a grid.
    pub rows: CellRows,
    /// Its columns; on a grid without those of the axes.
    pub columns: Vec<CellColumn>,
    /// How exactly its numbers are written.
    pub precision: Precision,
}

impl CellTable {
    /// Number of rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        match &self.rows {
            CellRows::Cells => self.numbers(PLACES[0]).map_or(0, <[f64]>::len),
            CellRows::Grid { x_mm, y_mm } => x_mm.len() * y_mm.len(),
        }
    }

    /// The names of the columns, those of the axes first.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        let axes: &[&str] = match self.rows {
            CellRows::Cells => &[],
            CellRows::Grid { .. } => &PLACES[..2],
        };
        let columns = self.columns.iter().map(|column| column.name);
        axes.iter().copied().chain(columns).collect()
    }

    /// The place of the value of a row within a column of [`CellTable::names`].
    pub fn index(&self, column: usize, row: usize) -> usize {
        match (&self.rows, column) {
            (CellRows::Grid { x_mm, .. }, 0) => row % x_mm.len(),
            (CellRows::Grid { x_mm, .. }, 1) => row / x_mm.len(),
            _ => row,
        }
    }

    /// Writes a value of a column of [`CellTable::names`], `none` where there is none; zones between quotes.
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

    /// Size in memory in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.row_count() * self.columns.len() * size_of::<f64>()
    }

    /// The numbers of a column.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find_map(|column| match &column.data {
            CellData::Numbers(values) if column.name == name => Some(&**values),
            _ => None,
        })
    }
}

/// Whether the rows of a table are cells of a mesh or samples of a grid.
#[derive(Debug, Clone, PartialEq)]
pub enum CellRows {
    /// One row per cell. The columns [`PLACES`] and `strip` say where the cell lies.
    Cells,
    /// One row per sample of a regular grid, x running fastest.
    Grid {
        /// Samples along x in mm, ascending.
        x_mm: Vec<f64>,
        /// Samples along y in mm, ascending.
        y_mm: Vec<f64>,
    },
}

/// The columns with the centre and the width of a cell.
pub const PLACES: [&str; 4] = ["x_mm", "y_mm", "dx_mm", "dy_mm"];

/// One value per row.
#[derive(Debug, Clone, PartialEq)]
pub struct CellColumn {
    /// Name of the column, equal in all formats.
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

/// The number of a zone where a format has no words: 0 stick, 1 slip, -1 outside the patch.
#[must_use]
pub fn zone_code(zone: Option<Zone>) -> i8 {
    match zone {
        Some(Zone::Stick) => 0,
        Some(Zone::Slip) => 1,
        None => -1,
    }
}
