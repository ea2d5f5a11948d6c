//! A wheelset over both rails, with what presses it down and what is asked of it.

use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::normal::wheel::task::WheelTask;

/// A wheelset over both rails, in all positions that are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelsetTask {
    /// The left and the right wheel over their rails, each with the vertical force it carries, in the first position without roll.
    pub sides: [WheelTask; 2],
    /// Shift to the left in mm and yaw in rad of every position; never empty.
    pub poses: Vec<[f64; 2]>,
    /// How the wheelset moves in every position.
    pub moves: Vec<WheelsetMove>,
    /// What is asked of the rigid wheelset.
    pub kinematics: Option<KinematicsTask>,
    /// Whether the right rail and wheel have cross-sections of their own, to which remarks are to point.
    pub own_right: [bool; 2],
}

impl WheelsetTask {
    /// The pointer to a cross-section of the right side, from what it would be for a single wheel.
    #[must_use]
    pub fn pointer_on_right(&self, pointer: &str) -> String {
        for (own, name) in self.own_right.into_iter().zip(["rail", "wheel"]) {
            if own && let Some(rest) = pointer.strip_prefix(&format!("/contact/{name}")) {
                return format!("/contact/right/{name}{rest}");
            }
        }
        pointer.to_owned()
    }
}

/// How a wheelset moves in a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelsetMove {
    /// Its motion; the angular velocity is NaN where it has to be found.
    pub motion: WheelsetMotion,
    /// Torque about the axle in N mm that the rails are to balance.
    pub drive_torque: Option<f64>,
}

/// Shifts and amplitudes, in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct KinematicsTask {
    /// Largest shift to either side.
    pub reach: f64,
    /// Distance of the shifts.
    pub step: f64,
    /// Amplitudes of the conicity.
    pub amplitudes: Vec<f64>,
}
