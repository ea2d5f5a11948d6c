//! Stresses below the surface as CSV: one line per point.

use crate::contact::solution::words::evolution::StressPoint;
use crate::http::render::csv::{finish, number};

const COLUMNS: [&str; 16] = [
    "x_mm",
    "y_mm",
    "depth_mm",
    "stress_xx_mpa",
    "stress_yy_mpa",
    "stress_zz_mpa",
    "stress_xy_mpa",
    "stress_xz_mpa",
    "stress_yz_mpa",
    "von_mises_mpa",
    "tresca_mpa",
    "principal_1_mpa",
    "principal_2_mpa",
    "principal_3_mpa",
    "hydrostatic_mpa",
    "shear_max_mpa",
];

/// The table.
///
/// # Errors
/// None that memory does not have.
pub(crate) fn csv(points: &[StressPoint]) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(COLUMNS)?;
    for point in points {
        let [x, y, depth] = point.at_mm;
        let stress = &point.stress_mpa;
        let [first, second, third] = point.principal_mpa;
        let values = [
            x,
            y,
            depth,
            stress.xx,
            stress.yy,
            stress.zz,
            stress.xy,
            stress.xz,
            stress.yz,
            point.von_mises_mpa,
            point.tresca_mpa,
            first,
            second,
            third,
            point.hydrostatic_mpa,
            point.shear_max_mpa,
        ];
        out.write_record(values.map(number))?;
    }
    finish(out)
}
