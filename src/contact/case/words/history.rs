//! Rolling that changes, as a client writes it: motions or forces in the distance rolled.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A motion that changes as the bodies roll. Creepages, spin and forces change linearly from one distance to the next; before the first
/// distance they are those of the first. The points of the answer are the distances.
///
/// Where a distance equals the one before, or is 0 at first, the bodies do not roll but are shifted: by `shift_x_mm`, `shift_y_mm` and
/// `turn_rad`, or until the prescribed forces are reached. Two equal distances are thus also a jump of a creepage or force.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct History {
    /// Distance rolled since the start in mm, never decreasing.
    pub distance_mm: HistoryCourse,
    /// Longitudinal creepage.
    pub creepage_x: Option<HistoryCourse>,
    /// Lateral creepage.
    pub creepage_y: Option<HistoryCourse>,
    /// Spin in 1/mm.
    pub spin_per_mm: Option<HistoryCourse>,
    /// Longitudinal force on the lower body in N, in place of `creepage_x`; creepages and shifts that give it are found.
    pub force_x_n: Option<HistoryCourse>,
    /// Lateral force on the lower body in N, in place of `creepage_y`.
    pub force_y_n: Option<HistoryCourse>,
    /// Rolling speed in mm/s, which friction that falls with slip needs.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_per_s: Option<f64>,
    /// Displacement of the upper body against the lower one along x in mm, from the point before; 0 where the bodies roll.
    pub shift_x_mm: Option<HistoryCourse>,
    /// The same along y.
    pub shift_y_mm: Option<HistoryCourse>,
    /// Turn of the upper body against the lower one about z in rad, from the point before; 0 where the bodies roll.
    pub turn_rad: Option<HistoryCourse>,
}

/// A number for all points of a history, or one value per point.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = Course)]
pub enum HistoryCourse {
    /// The same at every point.
    Constant(f64),
    /// Equally spaced values.
    Range(Range),
    /// One value per point.
    Values(Vec<f64>),
}

impl HistoryCourse {
    /// Number of values; 1 of a constant.
    #[must_use]
    pub fn points(&self) -> usize {
        match self {
            HistoryCourse::Constant(_) => 1,
            HistoryCourse::Range(range) => range.points as usize,
            HistoryCourse::Values(values) => values.len(),
        }
    }

    /// The values at so many points.
    #[must_use]
    pub fn values(&self, points: usize) -> Vec<f64> {
        match self {
            HistoryCourse::Constant(value) => vec![*value; points],
            HistoryCourse::Range(range) => range.values(),
            HistoryCourse::Values(values) => values.clone(),
        }
    }
}

/// The state in which a history begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
pub enum HistoryStartName {
    /// Pressed together without tangential tractions.
    #[default]
    Rest,
    /// In steady rolling with the motion or forces of the first point.
    Steady,
    /// Pressed together under friction without rolling: bodies that differ have tangential tractions then. For `radii` and `ellipse`.
    Pressed,
}

/// Equally spaced values, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Range {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values, at least 1.
    #[schema(minimum = 1)]
    pub points: u32,
}

impl Range {
    /// The values; the ends are exact.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        let last = self.points.saturating_sub(1);
        (0..self.points)
            .map(|n| {
                if n == 0 {
                    self.from
                } else if n == last {
                    self.to
                } else {
                    let t = f64::from(n) / f64::from(last);
                    self.from * (1.0 - t) + self.to * t
                }
            })
            .collect()
    }
}
