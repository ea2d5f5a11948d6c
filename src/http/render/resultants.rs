//! Forces and moments as a table.

use crate::dto::{Resultants, Sum};
use crate::render::forces::Forces;
use railhead_contact::solution::words::answer::HistoryPoint;
use railhead_tables::table::{RowTable, TableColumn};

type OfHistory = fn(&HistoryPoint) -> Option<f64>;

/// Columns of a history, behind all others; other cases do not have them.
const HISTORY: [(&str, OfHistory); 9] = [
    ("distance_mm", |at| Some(at.distance_mm)),
    ("dissipated_n_mm", |at| Some(at.dissipated_n_mm)),
    ("shift_x_mm", |at| at.shift_x_mm),
    ("shift_y_mm", |at| at.shift_y_mm),
    ("turn_rad", |at| at.turn_rad),
    ("creepage_x_error", |at| at.creepage_x_error),
    ("creepage_y_error", |at| at.creepage_y_error),
    ("shift_x_error_mm", |at| at.shift_x_error_mm),
    ("shift_y_error_mm", |at| at.shift_y_error_mm),
];

/// Name of the patch, number of the motion, and the sums and forces of the line.
type Line = (String, usize, Sum, Forces);

/// One line per patch and motion, then one per motion with the sums over all patches. `first` is the motion of the first total.
#[must_use]
pub(crate) fn table(resultants: &Resultants, first: usize, sums: &[Option<Sum>]) -> RowTable {
    let mut lines: Vec<Line> = Vec::new();
    for patch in &resultants.patches {
        for point in &patch.points {
            let sum = Sum {
                motion: point.motion,
                normal_force_n: point.normal_force_n,
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
            lines.push((patch.patch.to_string(), point.point, sum, forces));
        }
    }
    for (motion, total) in (first..).zip(&resultants.total) {
        if let Some(sum) = sums.get(motion).copied().flatten() {
            let forces = Forces::of_total(Some(sum.motion), total);
            lines.push(("total".to_owned(), motion, sum, forces));
        }
    }
    let text = |of: &dyn Fn(&Line) -> String| {
        TableColumn::Texts(lines.iter().map(|line| Some(of(line))).collect())
    };
    let number = |of: &dyn Fn(&Line) -> Option<f64>| {
        let values = lines.iter().map(|line| of(line).unwrap_or(f64::NAN));
        TableColumn::Numbers(values.collect())
    };
    let points = lines.iter().map(|(_, point, ..)| *point as i64);
    let mut columns = vec![
        ("patch", text(&|(patch, ..)| patch.clone())),
        ("point", TableColumn::Integers(points.collect())),
    ];
    columns.extend(Forces::COLUMNS.map(|name| {
        let values = number(&|(.., sum, forces)| match name {
            "normal_force_n" => Some(sum.normal_force_n),
            name => forces.number(name),
        });
        (name, values)
    }));
    let power = number(&|(.., sum, _)| Some(sum.friction_power_n));
    let without_spin = number(&|(.., sum, _)| Some(sum.friction_power_without_spin_n));
    columns.extend([
        ("friction_power_n", power),
        ("friction_power_without_spin_n", without_spin),
        ("saturated", text(&|(.., sum, _)| sum.saturated.to_string())),
    ]);
    if sums.iter().flatten().any(|sum| sum.history.is_some()) {
        columns.extend(HISTORY.map(|(name, of)| {
            let of_line = |(.., sum, _): &Line| of(sum.history.as_ref()?);
            (name, number(&of_line))
        }));
    }
    let columns = columns.into_iter();
    RowTable {
        columns: columns
            .map(|(name, column)| (name.to_owned(), column))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dto::{PatchResultants, PointResultants};
    use railhead_contact::case::words::motion::MotionWords;
    use railhead_contact::solution::words::answer::{Origin, Total};

    fn resultants(patches: usize, points: usize) -> Resultants {
        let point = |point: usize| PointResultants {
            point,
            motion: MotionWords {
                creepage_x: 0.1,
                creepage_y: 0.0,
                spin_per_mm: 1e-9,
            },
            normal_force_n: 0.1,
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
        for (patches, points) in [(1, 1), (2, 64), (3, 129)] {
            let sum = Sum {
                motion: resultants(1, 1).patches[0].points[0].motion,
                normal_force_n: 1.0,
                friction_power_n: 0.0,
                friction_power_without_spin_n: 0.0,
                saturated: false,
                history: None,
            };
            let lines =
                table(&resultants(patches, points), 0, &vec![Some(sum); points]).row_count();
            assert_eq!(lines, patches * points + points);
        }
    }
}
