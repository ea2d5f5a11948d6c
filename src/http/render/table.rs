//! Fields as tables, and the formats that a table can be written in; one format is one file here.

use utoipa::ToSchema;

use crate::dto::Outlines;
use crate::render::csv::{Precision, write_number};
use crate::render::shape::outlines::{outlines, patch_outline};
use crate::render::shape::resample::{Gridded, resample, resample_zone};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};

/// A file, byte for byte.
#[derive(Debug, ToSchema)]
#[schema(value_type = String, format = Binary)]
#[expect(dead_code, reason = "names binary bodies in the contract")]
pub(crate) struct File(Vec<u8>);

/// Named columns of equal length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    /// What a row belongs to.
    pub rows: Rows,
    /// Its columns; on a grid without those of the axes.
    pub columns: Vec<TableColumn>,
    /// How exactly its numbers are written.
    pub precision: Precision,
}

impl Outlines {
    /// The border of a patch, and those of its zones if they are wanted and known.
    #[must_use]
    pub(crate) fn of(cells: &PatchCells, point: &PointFields, with_zones: bool) -> Outlines {
        let zones = point.zone.as_deref().filter(|_| with_zones);
        let around = |zone| zones.map(|zones| outlines(cells, Some(zones), Some(zone)));
        Outlines {
            patch: patch_outline(cells),
            stick: around(Zone::Stick),
            slip: around(Zone::Slip),
        }
    }
}

impl Table {
    /// The values of these outputs: per cell, or resampled on a grid of `nx × ny` samples.
    #[must_use]
    pub(crate) fn of(
        outputs: &[Output],
        grid: Option<(usize, usize)>,
        mut cells: PatchCells,
        values: PointFields,
    ) -> Table {
        let wanted = |output| outputs.contains(&output);
        let zones = values.zone.filter(|_| wanted(Output::Zones));
        let numbers = [
            ("pressure_mpa", Output::Pressure, cells.pressure_mpa.take()),
            ("traction_x_mpa", Output::Tractions, values.traction_x_mpa),
            ("traction_y_mpa", Output::Tractions, values.traction_y_mpa),
            ("slip_x", Output::Slip, values.slip_x),
            ("slip_y", Output::Slip, values.slip_y),
            ("temperature_c", Output::Temperature, values.temperature_c),
        ];
        let numbers = numbers.into_iter().filter_map(|(name, output, values)| {
            let values = values.filter(|_| wanted(output))?;
            Some((name, values))
        });
        match grid {
            None => Table::of_cells(cells, zones, numbers),
            Some((nx, ny)) => Table::on_grid(&cells, zones, numbers, (nx, ny)),
        }
    }

    fn of_cells(
        cells: PatchCells,
        zones: Option<Vec<Zone>>,
        numbers: impl Iterator<Item = (&'static str, Vec<f64>)>,
    ) -> Table {
        let places = [cells.x_mm, cells.y_mm, cells.dx_mm, cells.dy_mm];
        let places = PLACES.into_iter().zip(places);
        let zones = zones.map(|zones| zones.into_iter().map(Some).collect());
        let column = |name, data| TableColumn { name, data };
        let number = |(name, values)| column(name, ArrayData::Numbers(values));
        Table {
            rows: Rows::Cells,
            columns: places
                .map(number)
                .chain([column("strip", ArrayData::Integers(cells.strip))])
                .chain(zones.map(|zones| column("zone", ArrayData::Zones(zones))))
                .chain(numbers.map(number))
                .collect(),
            precision: Precision::Double,
        }
    }

    fn on_grid(
        cells: &PatchCells,
        zones: Option<Vec<Zone>>,
        numbers: impl Iterator<Item = (&'static str, Vec<f64>)>,
        (nx, ny): (usize, usize),
    ) -> Table {
        fn flat<T: Copy>(grid: Gridded<T>, axes: &mut [Vec<f64>; 2]) -> Vec<Option<T>> {
            *axes = [grid.x_mm, grid.y_mm];
            grid.values.concat()
        }
        let mut axes = [Vec::new(), Vec::new()];
        let mut columns = Vec::new();
        if let Some(zones) = zones {
            let zones = flat(resample_zone(cells, &zones, nx, ny), &mut axes);
            columns.push(TableColumn {
                name: "zone",
                data: ArrayData::Zones(zones),
            });
        }
        for (name, values) in numbers {
            let values = flat(resample(cells, &values, nx, ny), &mut axes).into_iter();
            let values = values.map(|value| value.unwrap_or(f64::NAN)).collect();
            columns.push(TableColumn {
                name,
                data: ArrayData::Numbers(values),
            });
        }
        let [x_mm, y_mm] = axes;
        Table {
            rows: Rows::Grid { x_mm, y_mm },
            columns,
            precision: Precision::Double,
        }
    }

    /// Number of rows.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        match &self.rows {
            Rows::Cells => self.numbers(PLACES[0]).map_or(0, <[f64]>::len),
            Rows::Grid { x_mm, y_mm } => x_mm.len() * y_mm.len(),
        }
    }

    /// The names of the columns, those of the axes first.
    #[must_use]
    pub(crate) fn names(&self) -> Vec<&'static str> {
        let axes: &[&str] = match self.rows {
            Rows::Cells => &[],
            Rows::Grid { .. } => &PLACES[..2],
        };
        let columns = self.columns.iter().map(|column| column.name);
        axes.iter().copied().chain(columns).collect()
    }

    /// The place of the value of a row within a column of [`Table::names`].
    pub(crate) fn index(&self, column: usize, row: usize) -> usize {
        match (&self.rows, column) {
            (Rows::Grid { x_mm, .. }, 0) => row % x_mm.len(),
            (Rows::Grid { x_mm, .. }, 1) => row / x_mm.len(),
            _ => row,
        }
    }

    /// Writes a value of a column of [`Table::names`], `none` where there is none; zones between quotes.
    pub(crate) fn write(
        &self,
        out: &mut String,
        column: usize,
        index: usize,
        [none, quote]: [&str; 2],
    ) {
        let place = match (&self.rows, column) {
            (Rows::Grid { x_mm, .. }, 0) => {
                return write_number(out, x_mm[index], self.precision, none);
            }
            (Rows::Grid { y_mm, .. }, 1) => {
                return write_number(out, y_mm[index], self.precision, none);
            }
            (Rows::Grid { .. }, place) => place - 2,
            (Rows::Cells, place) => place,
        };
        match &self.columns[place].data {
            ArrayData::Numbers(values) => write_number(out, values[index], self.precision, none),
            ArrayData::Integers(values) => *out += &values[index].to_string(),
            ArrayData::Zones(zones) => match zones[index] {
                Some(zone) => *out += &format!("{quote}{}{quote}", zone.name()),
                None => *out += none,
            },
        }
    }

    /// Size in memory in bytes.
    #[must_use]
    pub(crate) fn bytes(&self) -> usize {
        self.len() * self.columns.len() * size_of::<f64>()
    }

    /// The numbers of a column.
    pub(crate) fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find_map(|column| match &column.data {
            ArrayData::Numbers(values) if column.name == name => Some(&**values),
            _ => None,
        })
    }
}

/// What the rows of a table belong to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Rows {
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
pub(crate) const PLACES: [&str; 4] = ["x_mm", "y_mm", "dx_mm", "dy_mm"];

/// One value per row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TableColumn {
    /// The same name in every format.
    pub name: &'static str,
    /// The values.
    pub data: ArrayData,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ArrayData {
    /// Numbers; NaN outside the patch.
    Numbers(Vec<f64>),
    /// Whole numbers.
    Integers(Vec<u32>),
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
