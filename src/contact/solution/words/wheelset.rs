//! The answer for a wheelset as the client reads it: its positions, and what it does as a rigid body over a range of shifts.

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What is answered of a wheelset beside its patches.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WheelsetAnswer {
    /// One entry per position, in the order of the case.
    pub positions: Vec<WheelsetPosition>,
    /// The rigid wheelset over a range of shifts; only if `kinematics` was asked for.
    pub kinematics: Option<Box<Kinematics>>,
}

/// A wheelset at rest on both rails under its load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WheelsetPosition {
    /// Shift to the left in mm, as given.
    pub lateral_shift_mm: f64,
    /// Yaw in rad, as given.
    pub yaw_rad: f64,
    /// Roll in rad, positive from y to z (the left wheel higher), at which both wheels carry their loads.
    pub roll_rad: f64,
    /// Height of the wheelset's centre over the top of the rails in mm; its change from one position to another is the lift.
    pub centre_height_mm: f64,
    /// Angular velocity about the axle in rad/s, given or found.
    pub angular_velocity_rad_per_s: f64,
    /// Torque about the axle in N mm that balances the forces of the rails: what a drive exerts, negative for a brake.
    pub drive_torque_n_mm: f64,
    /// Rolling radius of the left wheel less that of the right one in mm.
    pub radius_difference_mm: f64,
    /// The left wheel on its rail.
    pub left: WheelOnRail,
    /// The right wheel on its rail.
    pub right: WheelOnRail,
}

/// One wheel of a wheelset; forces act on the rail, in track axes, normal forces included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WheelOnRail {
    /// Indices of its patches in `patches`.
    pub patches: Vec<usize>,
    /// Rolling radius in mm at the patch that carries most.
    pub rolling_radius_mm: f64,
    /// Contact angle in rad of the patch that carries most.
    pub contact_angle_rad: f64,
    /// How far the wheel is below first touch, vertically, in mm.
    pub wheel_lowering_mm: f64,
    /// Along the track, in N.
    pub force_x_n: f64,
    /// To the left, in N.
    pub force_y_n: f64,
    /// Upward, in N; negative under a load.
    pub force_z_n: f64,
    /// About the vertical line through the middle of the track, in N mm.
    pub moment_z_n_mm: f64,
}

/// A rigid wheelset without yaw over a range of shifts; lists have one entry per shift.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Kinematics {
    /// Shifts to the left in mm. They end where a wheel leaves its rail or touches at the end of a cross-section.
    pub lateral_shift_mm: Vec<f64>,
    /// Roll in rad at which both wheels touch; null where there is none.
    pub roll_rad: Vec<Option<f64>>,
    /// Height of the wheelset's centre over the top of the rails in mm, with the roll; null where there is no roll.
    pub centre_height_mm: Vec<Option<f64>>,
    /// Δr of EN 15302, in mm: rolling radius of the left wheel less that of the right one, with the axle held level.
    pub radius_difference_mm: Vec<f64>,
    /// Δr in mm with the roll; null where there is no roll.
    #[serde(default)]
    pub radius_difference_with_roll_mm: Vec<Option<f64>>,
    /// Deprecated name of `radius_difference_mm`.
    pub radius_difference_without_roll_mm: Vec<f64>,
    /// How much Δr changes with another reading of the cross-sections, in mm.
    pub profile_uncertainty_mm: Vec<f64>,
    /// Where the left wheel touches, with the axle held level.
    pub left: TouchLine,
    /// Where the right wheel touches, with the axle held level.
    pub right: TouchLine,
    /// The shift in mm nearest to 0 at which Δr rises through 0: where a free wheelset runs on straight track. The middle of the shifts at which
    /// Δr is 0, if there are several. Absent if there is none.
    pub equilibrium_shift_mm: Option<f64>,
    /// How much this shift changes with another reading of the cross-sections, in mm.
    pub equilibrium_uncertainty_mm: Option<f64>,
    /// Distance across of the two places of contact in mm, at the shift nearest to the equilibrium, else to 0.
    pub contact_distance_mm: f64,
    /// Equivalent conicity, one entry per amplitude of the case.
    pub conicity: Vec<EquivalentConicity>,
    /// Why the shifts or values of the lists end early, or why there is no equilibrium.
    pub reason: Option<String>,
}

/// Where a rigid wheel touches its rail, shift by shift.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct TouchLine {
    /// Radius of the wheel there in mm.
    pub rolling_radius_mm: Vec<f64>,
    /// Contact angle in rad, signed as that of a patch.
    pub contact_angle_rad: Vec<f64>,
    /// y on the rail's cross-section in mm, positive to the field side.
    pub rail_y_mm: Vec<f64>,
    /// y on the wheel's cross-section in mm, positive to the field side.
    pub wheel_y_mm: Vec<f64>,
}

/// The equivalent conicity tan γ at one amplitude. `reason` explains every absent member.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EquivalentConicity {
    /// Half the distance of the turning points in mm.
    pub amplitude_mm: f64,
    /// tan γ of EN 15302, by integration of the wheelset's equation of motion with Δr of the level axle. 0 where Δr is 0 over the whole
    /// amplitude.
    pub conicity: Option<f64>,
    /// tan γ from Δr with the roll. Of a cone the roll adds some percent to the cone's own tangent.
    pub conicity_with_roll: Option<f64>,
    /// Deprecated name of `conicity`.
    pub conicity_without_roll: Option<f64>,
    /// tan γ by harmonic linearisation of Δr between the same turning points.
    pub conicity_harmonic: Option<f64>,
    /// Error of `conicity` from the distance of the shifts.
    pub error_estimate: Option<f64>,
    /// How much `conicity` changes with another reading of the cross-sections.
    pub profile_uncertainty: Option<f64>,
    /// Wavelength of the motion in mm.
    pub wavelength_mm: Option<f64>,
    /// Shifts in mm at which the motion turns.
    pub turns_mm: Option<[f64; 2]>,
    /// Why members are absent.
    pub reason: Option<String>,
}
