//! Fields as tables, per cell or on a grid.

use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};
use railhead_tables::cells::{CellColumn, CellData, CellRows, CellTable, PLACES};
use railhead_tables::csv::Precision;
use utoipa::ToSchema;

use crate::dto::Outlines;
use crate::render::shape::outlines::{outlines, patch_outline};
use crate::render::shape::resample::{Gridded, resample, resample_zone};

/// A binary body.
#[derive(Debug, ToSchema)]
#[schema(value_type = String, format = Binary)]
#[expect(dead_code, reason = "names binary bodies in the contract")]
pub(crate) struct File(Vec<u8>);

impl Outlines {
    /// Returns the border of a patch, and with `with_zones` those of its zones if they are known.
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

/// Returns the values of these outputs, per cell or resampled on a grid of `nx × ny` samples.
#[must_use]
pub(crate) fn cell_table(
    outputs: &[Output],
    grid: Option<(usize, usize)>,
    mut cells: PatchCells,
    values: PointFields,
) -> CellTable {
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
        None => of_cells(cells, zones, numbers),
        Some((nx, ny)) => on_grid(&cells, zones, numbers, (nx, ny)),
    }
}

fn of_cells(
    cells: PatchCells,
    zones: Option<Vec<Zone>>,
    numbers: impl Iterator<Item = (&'static str, Vec<f64>)>,
) -> CellTable {
    let places = [cells.x_mm, cells.y_mm, cells.dx_mm, cells.dy_mm];
    let places = PLACES.into_iter().zip(places);
    let zones = zones.map(|zones| zones.into_iter().map(Some).collect());
    let column = |name, data| CellColumn { name, data };
    let number = |(name, values)| column(name, CellData::Numbers(values));
    CellTable {
        rows: CellRows::Cells,
        columns: places
            .map(number)
            .chain([column("strip", CellData::Integers(cells.strip))])
            .chain(zones.map(|zones| column("zone", CellData::Zones(zones))))
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
) -> CellTable {
    fn flat<T: Copy>(grid: Gridded<T>, axes: &mut [Vec<f64>; 2]) -> Vec<Option<T>> {
        *axes = [grid.x_mm, grid.y_mm];
        grid.values.concat()
    }
    let mut axes = [Vec::new(), Vec::new()];
    let mut columns = Vec::new();
    if let Some(zones) = zones {
        let zones = flat(resample_zone(cells, &zones, nx, ny), &mut axes);
        columns.push(CellColumn {
            name: "zone",
            data: CellData::Zones(zones),
        });
    }
    for (name, values) in numbers {
        let values = flat(resample(cells, &values, nx, ny), &mut axes).into_iter();
        let values = values.map(|value| value.unwrap_or(f64::NAN)).collect();
        columns.push(CellColumn {
            name,
            data: CellData::Numbers(values),
        });
    }
    let [x_mm, y_mm] = axes;
    CellTable {
        rows: CellRows::Grid { x_mm, y_mm },
        columns,
        precision: Precision::Double,
    }
}
