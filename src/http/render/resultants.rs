//! Forces and moments as a table.

use crate::contact::solution::words::answer::HistoryPoint;
use crate::http::dto::{Resultants, Sum};
use crate::http::render::csv::{finish, number};
use crate::http::render::forces::Forces;

/// Before and behind the columns of [`Forces`].
const PLACE: [&str; 2] = ["patch", "point"];
const REST: [&str; 3] = [
    "friction_power_n",
    "friction_power_without_spin_n",
    "saturated",
];

/// Columns of a history, behind all others; other cases do not have them.
const HISTORY: [&str; 9] = [
    "distance_mm",
    "dissipated_n_mm",
    "shift_x_mm",
    "shift_y_mm",
    "turn_rad",
    "creepage_x_error",
    "creepage_y_error",
    "shift_x_error_mm",
    "shift_y_error_mm",
];

/// One line per patch and motion, then one per motion with the sums over all patches.
///
/// # Errors
/// Never, as memory takes all that is written.
pub(crate) fn csv(resultants: &Resultants, sums: &[Sum]) -> Result<Vec<u8>, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    let history: &[&str] = match sums.first().and_then(|sum| sum.history) {
        Some(_) => &HISTORY,
        None => &[],
    };
    let columns = PLACE.iter().chain(&Forces::COLUMNS).chain(&REST);
    out.write_record(columns.chain(history))?;
    for patch in &resultants.patches {
        for point in &patch.points {
            let sum = Sum {
                motion: point.motion,
                normal_force_n: patch.normal_force_n,
                friction_power_n: point.friction_power_n,
                friction_power_without_spin_n: point.friction_power_without_spin_n,
                saturated: point.saturated,
                history: point.history.as_deref().copied(),
            };
            let forces = Forces {
                motion: Some(point.motion),
                resultants: [point.force_x_n, point.force_y_n, point.moment_z_n_mm],
                error: point.error_estimate,
            };
            let number = patch.patch.to_string();
            out.write_record(csv_line(&number, point.point, &sum, &forces))?;
        }
    }
    // The numbers of the motions are those of any patch.
    let points = resultants.patches.first().map(|patch| &patch.points);
    for (point, total) in points.into_iter().flatten().zip(&resultants.total) {
        if let Some(sum) = sums.get(point.point) {
            let forces = Forces::of_total(Some(sum.motion), total);
            out.write_record(csv_line("total", point.point, sum, &forces))?;
        }
    }
    finish(out)
}

/// The values of the columns of a history.
fn of_history(history: &HistoryPoint) -> [Option<f64>; 9] {
    [
        Some(history.distance_mm),
        Some(history.dissipated_n_mm),
        history.shift_x_mm,
        history.shift_y_mm,
        history.turn_rad,
        history.creepage_x_error,
        history.creepage_y_error,
        history.shift_x_error_mm,
        history.shift_y_error_mm,
    ]
}

fn csv_line(
    patch: &str,
    point: usize,
    sum: &Sum,
    forces: &Forces,
) -> impl IntoIterator<Item = String> {
    let values = Forces::COLUMNS.map(|name| match name {
        "normal_force_n" => number(sum.normal_force_n),
        name => forces.number(name).map_or_else(String::new, number),
    });
    let rest = [
        number(sum.friction_power_n),
        number(sum.friction_power_without_spin_n),
        sum.saturated.to_string(),
    ];
    let place = [patch.to_owned(), point.to_string()];
    let history = sum.history.as_ref().map(of_history);
    let text = |value: Option<f64>| value.map_or_else(String::new, number);
    let history = history.into_iter().flatten().map(text);
    place.into_iter().chain(values).chain(rest).chain(history)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::case::words::motion::MotionWords;
    use crate::contact::solution::words::answer::{Origin, Total};
    use crate::http::dto::{PatchResultants, PointResultants};

    fn resultants(patches: usize, points: usize) -> Resultants {
        let point = |point: usize| PointResultants {
            point,
            motion: MotionWords {
                creepage_x: 0.1,
                creepage_y: 0.0,
                spin_per_mm: 1e-9,
            },
            force_x_n: 1.0 / (1 + point) as f64,
            force_y_n: -0.1,
            moment_z_n_mm: 1e-300,
            error_estimate: None,
            profile_uncertainty: None,
            friction_power_n: 0.0,
            friction_power_without_spin_n: 0.0,
            saturated: false,
            history: None,
        };
        let points: Vec<_> = (0..points).map(point).collect();
        let total = points.iter().map(|point| Total {
            force_x_n: point.force_x_n,
            force_y_n: point.force_y_n,
            force_z_n: None,
            moment_z_n_mm: point.moment_z_n_mm,
            error_estimate: None,
            profile_uncertainty: None,
        });
        let total = total.collect();
        let patch = |patch: usize| PatchResultants {
            patch,
            normal_force_n: 0.1 + patch as f64,
            points: (0..points.len()).map(point).collect(),
        };
        Resultants {
            patches: (0..patches).map(patch).collect(),
            total,
            origin: Origin {
                x_mm: 0.0,
                y_mm: 0.1,
                meaning: "a \"point\"".to_owned(),
            },
        }
    }

    #[test]
    fn a_table_has_a_line_per_patch_and_motion_and_one_per_motion_in_sum() {
        for (patches, points) in [(0, 0), (1, 1), (2, 64), (3, 129)] {
            let sum = Sum {
                motion: resultants(1, 1).patches[0].points[0].motion,
                normal_force_n: 1.0,
                friction_power_n: 0.0,
                friction_power_without_spin_n: 0.0,
                saturated: false,
                history: None,
            };
            let table = csv(&resultants(patches, points), &vec![sum; points]).unwrap();
            let lines = String::from_utf8(table).unwrap().lines().count();
            let totals = if patches == 0 { 0 } else { points };
            assert_eq!(lines, 1 + patches * points + totals);
        }
    }
}
