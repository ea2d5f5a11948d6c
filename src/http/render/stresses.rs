//! Stresses below the surface as CSV: one line per point.

use crate::contact::solution::words::evolution::StressPoint;
use crate::http::render::csv::{Precision, head, lines, write_number};

type Column = (&'static str, fn(&StressPoint) -> f64);

const COLUMNS: [Column; 16] = [
    ("x_mm", |point| point.at_mm[0]),
    ("y_mm", |point| point.at_mm[1]),
    ("depth_mm", |point| point.at_mm[2]),
    ("stress_xx_mpa", |point| point.stress_mpa.xx),
    ("stress_yy_mpa", |point| point.stress_mpa.yy),
    ("stress_zz_mpa", |point| point.stress_mpa.zz),
    ("stress_xy_mpa", |point| point.stress_mpa.xy),
    ("stress_xz_mpa", |point| point.stress_mpa.xz),
    ("stress_yz_mpa", |point| point.stress_mpa.yz),
    ("von_mises_mpa", |point| point.von_mises_mpa),
    ("tresca_mpa", |point| point.tresca_mpa),
    ("principal_1_mpa", |point| point.principal_mpa[0]),
    ("principal_2_mpa", |point| point.principal_mpa[1]),
    ("principal_3_mpa", |point| point.principal_mpa[2]),
    ("hydrostatic_mpa", |point| point.hydrostatic_mpa),
    ("shear_max_mpa", |point| point.shear_max_mpa),
];

/// The table.
///
/// # Errors
/// Never, as memory takes all that is written.
pub(crate) fn csv(points: &[StressPoint]) -> Result<Vec<u8>, csv::Error> {
    let lines = lines(COLUMNS.len(), 0..points.len(), |out, column, row| {
        write_number(out, COLUMNS[column].1(&points[row]), Precision::Double, "");
    });
    Ok([head(COLUMNS.map(|(name, _)| name))?, lines?].concat())
}
