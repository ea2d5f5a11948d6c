//! How the bodies roll: one motion, a list, a sweep, a history or a wheelset.
//!
//! Rolling that changes, as a client writes it: motions or forces in the distance rolled.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Rolling motion of the upper body relative to the lower one, divided by the rolling speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Motion)]
pub struct MotionWords {
    /// Longitudinal creepage, dimensionless.
    #[schema(required = false)]
    pub creepage_x: f64,
    /// Lateral creepage, dimensionless.
    #[schema(required = false)]
    pub creepage_y: f64,
    /// Spin in 1/mm.
    #[schema(required = false)]
    pub spin_per_mm: f64,
}

/// A motion as a case gives it: creepages and spin. A tangential force may be given in place of a creepage; the creepage that gives this
/// force is then found and reported in the answer.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, ToSchema)]
pub struct AskedMotion {
    /// Longitudinal creepage, dimensionless; 0 when left out.
    pub creepage_x: Option<f64>,
    /// Lateral creepage, dimensionless; 0 when left out.
    pub creepage_y: Option<f64>,
    /// Spin in 1/mm.
    #[schema(required = false)]
    pub spin_per_mm: f64,
    /// Longitudinal force on the lower body in N, over all patches, at most μN. Excludes `creepage_x`; with `profiles` in one motion alone.
    pub force_x_n: Option<f64>,
    /// Lateral force on the lower body in N, over all patches, at most μN. Excludes `creepage_y`; with `profiles` in one motion alone: in track axes, with the normal forces.
    pub force_y_n: Option<f64>,
    /// Rolling speed in mm/s; only temperatures, Archard's wear and friction that falls with slip depend on it.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_per_s: Option<f64>,
}

/// One motion, a list of motions on the same patch, or a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Motions {
    /// One motion; components left out are 0, but at least one has to be given.
    One(AskedMotion),
    /// Several motions on the same patch, solved in order.
    Many(Vec<AskedMotion>),
    /// Motions generated from values of their components.
    Sweep {
        /// The values of its components.
        sweep: Sweep,
    },
    /// Rolling that changes: motions or forces in the distance rolled.
    History {
        /// Motions, forces and shifts, distance by distance.
        history: History,
        /// The state at the distance 0; `rest` when left out.
        #[schema(required = false)]
        start: HistoryStartName,
    },
    /// The motion of the wheelset, from which every patch gets its own creepages; for `profiles` and `wheelset`.
    Wheelset {
        /// How the wheelset moves.
        wheelset: Wheelset,
    },
    /// Several motions of the wheelset, for the contact `wheelset` only: with `combine: together` one for each position, or all in the same
    /// position; with `grid` every position with every motion, motions fastest.
    Wheelsets {
        /// How the wheelset moves; never empty.
        wheelset: Vec<Wheelset>,
    },
}

/// Motion of a wheelset. Exactly one of `angular_velocity_rad_per_s`, `free_rolling_radius_mm`, `drive_torque_n_mm` and `force_x_n` is given;
/// `force_y_n` excludes `lateral_velocity_mm_per_s`.
///
/// With the speed V, the axle e, the angular velocity ω = Ω e + (roll rate, 0, yaw rate) and r from the wheelset's centre to the
/// patch, the wheel's material moves with v = (V, lateral velocity, 0) + ω × r; the creepages of a patch with the tangent t and the
/// normal n are v_x / V, v · t / V and the spin ω · n / V.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Wheelset {
    /// Speed V along x in mm/s, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_per_s: f64,
    /// Angular velocity Ω about the axle in rad/s, positive for rolling forward.
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Radius in mm at which the wheel would roll freely: Ω is the speed divided by it.
    #[schema(exclusive_minimum = 0.0)]
    pub free_rolling_radius_mm: Option<f64>,
    /// Torque about the axle that a drive or a brake exerts on the wheelset, in N mm, positive if it drives forward; for the contact
    /// `wheelset` only. The angular velocity is found at which the rails balance it: 0 is a wheelset that rolls freely.
    pub drive_torque_n_mm: Option<f64>,
    /// Longitudinal force on the rail in N, over all patches of the wheel; for the contact `profiles` only. The angular velocity is found at which
    /// the rail carries it.
    pub force_x_n: Option<f64>,
    /// Velocity of the centre to the left in mm/s; 0 when left out.
    pub lateral_velocity_mm_per_s: Option<f64>,
    /// Lateral force on the rail in N, over all patches of the wheel, in track axes and with the normal forces; for the contact `profiles` only.
    /// The lateral velocity is found at which the rail carries it.
    pub force_y_n: Option<f64>,
    /// Rate of the yaw in rad/s; 0 when left out.
    #[schema(required = false)]
    pub yaw_rate_rad_per_s: f64,
    /// Rate of the roll in rad/s; 0 when left out.
    #[schema(required = false)]
    pub roll_rate_rad_per_s: f64,
}

/// Values of the motion's components. A component left out is 0.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Sweep {
    /// Longitudinal creepage.
    pub creepage_x: Option<Swept>,
    /// Lateral creepage.
    pub creepage_y: Option<Swept>,
    /// Spin in 1/mm.
    pub spin_per_mm: Option<Swept>,
    /// Longitudinal force on the lower body in N, in place of `creepage_x`.
    pub force_x_n: Option<Swept>,
    /// Lateral force on the lower body in N, in place of `creepage_y`.
    pub force_y_n: Option<Swept>,
    /// Rolling speed in mm/s, the same for all motions; only temperatures, Archard's wear and friction that falls with slip depend on it.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_per_s: Option<f64>,
    /// `together` (default): all components that vary have the same number of values, and motion n has value n of each; `grid`: every
    /// combination of values. In a grid, the last component of this list varies fastest; a force takes the position of the creepage it
    /// replaces.
    #[schema(required = false)]
    pub combine: Combine,
}

/// How several components of a sweep are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// Motion n has value n of every component; all components that vary have the same number of values.
    #[default]
    Together,
    /// Every combination.
    Grid,
}

/// The values of one component of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Swept {
    /// The same value in every motion.
    Constant(f64),
    /// Equally spaced values.
    Range(Range),
    /// These values, in this order.
    List(ValueList),
}

/// Values one by one.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ValueList {
    /// The values, at least one.
    #[schema(min_items = 1)]
    pub values: Vec<f64>,
}

impl Swept {
    /// Number of values.
    #[must_use]
    pub fn points(&self) -> usize {
        match self {
            Swept::Constant(_) => 1,
            Swept::Range(range) => range.points as usize,
            Swept::List(list) => list.values.len(),
        }
    }
}

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

    /// The values at `points` points.
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
