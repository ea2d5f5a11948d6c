//! Fields as tables, and the formats that a table can be written in; one format is one file here.

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::solution::words::fields::Zone;
use crate::http::dto::cells::{Cells, GriddedField};

/// A file, byte for byte.
#[derive(Debug, ToSchema)]
#[schema(value_type = String, format = Binary)]
#[expect(dead_code, reason = "names binary bodies in the contract")]
pub(crate) struct File(Vec<u8>);

/// Named columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What a row belongs to.
    pub rows: Rows,
    /// The values of the field.
    pub values: Vec<TableColumn>,
    /// How exactly its numbers are written.
    pub precision: Precision,
}

/// How exactly numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// As they were computed: 64 bits.
    #[default]
    Double,
    /// 32 bits, some seven digits: enough for pictures, and half as large.
    Single,
}

impl Table {
    /// How many rows it has.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.rows {
            Rows::Cells { strip, .. } => strip.len(),
            Rows::Grid { x_mm, y_mm } => x_mm.len() * y_mm.len(),
        }
    }

    /// What it takes in memory, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let columns = match &self.rows {
            Rows::Cells { .. } => PLACES.len() + 1,
            Rows::Grid { .. } => 0,
        };
        self.len() * (columns + self.values.len()) * size_of::<f64>()
    }
}

/// What the rows of a table belong to.
#[derive(Debug, Clone, PartialEq)]
pub enum Rows {
    /// One row per cell, with the columns that say where the cell lies: `x_mm`, `y_mm`, `dx_mm`, `dy_mm`, `strip`.
    Cells {
        /// Centre along x, centre across, width along x, width across; in mm.
        places: [Vec<f64>; 4],
        /// Number of the strip.
        strip: Vec<u32>,
    },
    /// One row per sample of a regular grid, x running fastest.
    Grid {
        /// Samples along x in mm, ascending.
        x_mm: Vec<f64>,
        /// Samples across in mm, ascending.
        y_mm: Vec<f64>,
    },
}

/// The columns of [`Rows::Cells`] before `strip`.
pub(crate) const PLACES: [&str; 4] = ["x_mm", "y_mm", "dx_mm", "dy_mm"];

/// One value per row.
#[derive(Debug, Clone, PartialEq)]
pub struct TableColumn {
    /// The same name in every format.
    pub name: &'static str,
    /// The values.
    pub data: ArrayData,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum ArrayData {
    /// Numbers; NaN outside the patch.
    Numbers(Vec<f64>),
    /// Zones; `None` outside the patch.
    Zones(Vec<Option<Zone>>),
}

/// The number of a zone where a format has no words: 0 stick, 1 slip, -1 outside the patch.
#[must_use]
pub(crate) fn zone_code(zone: Option<Zone>) -> i8 {
    match zone {
        Some(Zone::Stick) => 0,
        Some(Zone::Slip) => 1,
        None => -1,
    }
}

impl From<Cells> for Table {
    fn from(cells: Cells) -> Self {
        let zone = cells.zone.map(|zones| TableColumn {
            name: "zone",
            data: ArrayData::Zones(zones.into_iter().map(Some).collect()),
        });
        let numbers = [
            ("pressure_mpa", cells.pressure_mpa),
            ("traction_x_mpa", cells.traction_x_mpa),
            ("traction_y_mpa", cells.traction_y_mpa),
            ("slip_x", cells.slip_x),
            ("slip_y", cells.slip_y),
            ("temperature_c", cells.temperature_c),
        ];
        Table {
            rows: Rows::Cells {
                places: [cells.x_mm, cells.y_mm, cells.dx_mm, cells.dy_mm],
                strip: cells.strip,
            },
            values: zone.into_iter().chain(columns(numbers)).collect(),
            precision: Precision::Double,
        }
    }
}

impl From<GriddedField> for Table {
    fn from(field: GriddedField) -> Self {
        let zone = field.zone.map(|rows| TableColumn {
            name: "zone",
            data: ArrayData::Zones(rows.concat()),
        });
        let flat = |rows: Option<Vec<Vec<Option<f64>>>>| {
            let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
            rows.map(|rows| rows.into_iter().flatten().map(number).collect())
        };
        let numbers = [
            ("pressure_mpa", flat(field.pressure_mpa)),
            ("traction_x_mpa", flat(field.traction_x_mpa)),
            ("traction_y_mpa", flat(field.traction_y_mpa)),
            ("slip_x", flat(field.slip_x)),
            ("slip_y", flat(field.slip_y)),
            ("temperature_c", flat(field.temperature_c)),
        ];
        Table {
            rows: Rows::Grid {
                x_mm: field.x_mm,
                y_mm: field.y_mm,
            },
            values: zone.into_iter().chain(columns(numbers)).collect(),
            precision: Precision::Double,
        }
    }
}

fn columns<const N: usize>(
    numbers: [(&'static str, Option<Vec<f64>>); N],
) -> impl Iterator<Item = TableColumn> {
    numbers.into_iter().filter_map(|(name, values)| {
        Some(TableColumn {
            name,
            data: ArrayData::Numbers(values?),
        })
    })
}
