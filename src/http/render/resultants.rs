//! Forces and moments as a table.

use crate::dto::{PointResultants, Resultants};
use railhead_contact::solution::words::answer::HistoryPoint;
use railhead_tables::table::{RowTable, TableColumn};

type OfPoint = fn(&PointResultants) -> Option<f64>;
type OfHistory = fn(&HistoryPoint) -> Option<f64>;

const COLUMNS: [(&str, OfPoint); 12] = [
    ("creepage_x", |at| Some(at.motion.creepage_x)),
    ("creepage_y", |at| Some(at.motion.creepage_y)),
    ("spin_per_mm", |at| Some(at.motion.spin_per_mm)),
    ("normal_force_n", |at| Some(at.normal_force_n)),
    ("force_x_n", |at| Some(at.force_x_n)),
    ("force_y_n", |at| Some(at.force_y_n)),
    ("moment_z_n_mm", |at| Some(at.moment_z_n_mm)),
    ("error_force_x_n", |at| Some(at.error_estimate?.force_x_n)),
    ("error_force_y_n", |at| Some(at.error_estimate?.force_y_n)),
    ("error_moment_z_n_mm", |at| {
        Some(at.error_estimate?.moment_z_n_mm)
    }),
    ("friction_power_n", |at| Some(at.friction_power_n)),
    ("friction_power_without_spin_n", |at| {
        Some(at.friction_power_without_spin_n)
    }),
];

/// Columns after all others, only for a history.
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

/// Returns a table with a row per patch and motion, followed by a row per motion with the sums over all patches.
#[must_use]
pub(crate) fn table(resultants: &Resultants, totals: &[PointResultants]) -> RowTable {
    let patches = resultants.patches.iter().flat_map(|patch| {
        let points = patch.points.iter();
        points.map(|point| (patch.patch.to_string(), point))
    });
    let totals = totals.iter().map(|point| ("total".to_owned(), point));
    let rows: Vec<(String, &PointResultants)> = patches.chain(totals).collect();
    let number = |of: &dyn Fn(&PointResultants) -> Option<f64>| {
        let values = rows.iter().map(|(_, point)| of(point).unwrap_or(f64::NAN));
        TableColumn::Numbers(values.collect())
    };
    let patches = rows.iter().map(|(patch, _)| Some(patch.clone())).collect();
    let points = rows.iter().map(|(_, point)| point.point as i64).collect();
    let saturated = rows
        .iter()
        .map(|(_, point)| Some(point.saturated.to_string()));
    let mut columns = vec![
        ("patch", TableColumn::Texts(patches)),
        ("point", TableColumn::Integers(points)),
    ];
    columns.extend(COLUMNS.map(|(name, of)| (name, number(&of))));
    columns.push(("saturated", TableColumn::Texts(saturated.collect())));
    if rows.iter().any(|(_, point)| point.history.is_some()) {
        let history = |of: OfHistory| number(&|point| of(point.history.as_deref()?));
        columns.extend(HISTORY.map(|(name, of)| (name, history(of))));
    }
    let columns = columns.into_iter();
    RowTable {
        columns: columns
            .map(|(name, column)| (name.to_owned(), column))
            .collect(),
    }
}
