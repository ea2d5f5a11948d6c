//! Writes legacy VTK, version 3.0, binary (big-endian), for ParaView, PyVista and meshio.
//!
//! Values per cell are cell data of an unstructured grid with a quadrilateral per cell. Values on a grid are point data of structured points,
//! NaN outside the patch. Pairs such as `traction_x_mpa`, `traction_y_mpa` are one vector `traction_mpa` with z = 0. Zones are 0 stick, 1 slip,
//! -1 outside the patch.

use crate::cells::{CellData, CellRows, CellTable, PLACES, zone_code};

/// Longest title of the format, without its line break.
const TITLE_MAX: usize = 255;
/// Cell type of a quadrilateral.
const QUAD: i32 = 9;
/// Names of the components of a vector, and of the vector.
const VECTORS: [(&str, &str, &str); 2] = [
    ("traction_x_mpa", "traction_y_mpa", "traction_mpa"),
    ("slip_x", "slip_y", "slip"),
];

/// Writes a table with a title, in which `?` replaces characters other than printable ASCII.
#[must_use]
pub fn write(table: &CellTable, title: &str) -> Vec<u8> {
    let mut out = Vec::new();
    line(&mut out, "# vtk DataFile Version 3.0");
    let title = title.chars().take(TITLE_MAX);
    let plain = |c: char| match c {
        ' ' | '!'..='~' => c,
        _ => '?',
    };
    line(&mut out, &title.map(plain).collect::<String>());
    line(&mut out, "BINARY");
    match &table.rows {
        CellRows::Cells => {
            let places = PLACES.map(|name| table.numbers(name).unwrap_or_default());
            write_quads(&mut out, places);
            line(&mut out, &format!("CELL_DATA {}", table.row_count()));
        }
        CellRows::Grid { x_mm, y_mm } => {
            write_points(&mut out, x_mm, y_mm);
            line(&mut out, &format!("POINT_DATA {}", x_mm.len() * y_mm.len()));
        }
    }
    write_values(&mut out, table);
    out
}

fn write_quads(out: &mut Vec<u8>, [x, y, dx, dy]: [&[f64]; 4]) {
    let count = x.len();
    line(out, "DATASET UNSTRUCTURED_GRID");
    line(out, &format!("POINTS {} double", 4 * count));
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    let points = (0..count).flat_map(|cell| {
        corners.map(|(right, up)| [x[cell] + right * dx[cell], y[cell] + up * dy[cell], 0.0])
    });
    doubles(out, points.flatten());
    line(out, &format!("CELLS {count} {}", 5 * count));
    let count = i32::try_from(count).unwrap_or(i32::MAX);
    let corners =
        (0..count).flat_map(|cell| [4, 4 * cell, 4 * cell + 1, 4 * cell + 2, 4 * cell + 3]);
    integers(out, corners);
    line(out, &format!("CELL_TYPES {count}"));
    integers(out, (0..count).map(|_| QUAD));
}

fn write_points(out: &mut Vec<u8>, x: &[f64], y: &[f64]) {
    let step = |axis: &[f64]| match axis {
        [first, .., last] => {
            #[expect(clippy::cast_precision_loss, reason = "at most 1000 samples")]
            let steps = (axis.len() - 1) as f64;
            (last - first) / steps
        }
        _ => 1.0,
    };
    let first = |axis: &[f64]| axis.first().copied().unwrap_or(0.0);
    line(out, "DATASET STRUCTURED_POINTS");
    line(out, &format!("DIMENSIONS {} {} 1", x.len(), y.len()));
    line(out, &format!("ORIGIN {:?} {:?} 0", first(x), first(y)));
    line(out, &format!("SPACING {:?} {:?} 1", step(x), step(y)));
}

fn write_values(out: &mut Vec<u8>, table: &CellTable) {
    let columns = table.columns.iter();
    for column in columns.filter(|column| !PLACES.contains(&column.name)) {
        match &column.data {
            CellData::Integers(values) => {
                line(out, &format!("SCALARS {} int 1", column.name));
                line(out, "LOOKUP_TABLE default");
                let values = values.iter();
                integers(
                    out,
                    values.map(|value| i32::try_from(*value).unwrap_or(i32::MAX)),
                );
            }
            CellData::Zones(zones) => {
                line(out, &format!("SCALARS {} int 1", column.name));
                line(out, "LOOKUP_TABLE default");
                integers(out, zones.iter().map(|zone| zone_code(*zone).into()));
            }
            CellData::Numbers(values) => {
                let vector = VECTORS
                    .iter()
                    .find(|(x, y, _)| [*x, *y].contains(&column.name));
                let Some((x_name, y_name, name)) = vector else {
                    line(out, &format!("SCALARS {} double 1", column.name));
                    line(out, "LOOKUP_TABLE default");
                    doubles(out, values.iter().copied());
                    continue;
                };
                // The vector takes the place of the first component.
                if column.name == *x_name
                    && let Some(y) = table.numbers(y_name)
                {
                    line(out, &format!("VECTORS {name} double"));
                    let pairs = values.iter().zip(y);
                    doubles(out, pairs.flat_map(|(x, y)| [*x, *y, 0.0]));
                }
            }
        }
    }
}

fn line(out: &mut Vec<u8>, text: &str) {
    out.extend_from_slice(text.as_bytes());
    out.push(b'\n');
}

fn doubles(out: &mut Vec<u8>, values: impl Iterator<Item = f64>) {
    out.extend(values.flat_map(f64::to_be_bytes));
    out.push(b'\n');
}

fn integers(out: &mut Vec<u8>, values: impl Iterator<Item = i32>) {
    out.extend(values.flat_map(i32::to_be_bytes));
    out.push(b'\n');
}
