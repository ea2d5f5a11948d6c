//! Stresses below the surface as a table.

use railhead_contact::solution::words::evolution::StressPoint;
use railhead_tables::table::{RowTable, TableColumn};

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

/// Returns a table with a row per point.
#[must_use]
pub(crate) fn table(points: &[StressPoint]) -> RowTable {
    let column = |(name, of): Column| {
        let values = points.iter().map(of).collect();
        (name.to_owned(), TableColumn::Numbers(values))
    };
    RowTable {
        columns: COLUMNS.map(column).into(),
    }
}
