//! The answer to a case: [`Solution`] without values per cell, [`Fields`] with them, and [`Understanding`] before a solve.
//!
//! Forces and tractions act on the lower body (body 2, the rail). Frame: x along rolling (the leading edge is at the larger x), y to the left,
//! z up; moments and spin refer to [`Solution::origin`].

use railhead_macros::{Finite, Named, keyword, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::case::words::contact::Load;
use crate::case::words::solver::MethodName;
use crate::remark::entry::RemarkEntry;
use crate::rolling::task::Motion;
use crate::solution::words::damage::{Damage, DamageFiguresUsed, PatchQuality, ProfileUncertainty};
use crate::solution::words::evolution::{SubsurfaceSummary, TemperatureSummary};

/// The result of one case, without fields.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct Solution {
    /// One entry per contact patch.
    pub patches: Vec<PatchSolution>,
    /// One entry per motion: plain sums over the patches.
    pub total: Vec<Total>,
    /// Remarks to read before using the numbers.
    #[serde(default)]
    pub remarks: Vec<RemarkEntry>,
    /// How region and pressure were computed; absent if they were known beforehand. For several motions of bodies with different materials:
    /// those of the first.
    #[schema(nullable = true)]
    pub normal: Option<NormalReport>,
    /// Vertical displacement of the wheel below first touch in mm; only for `profiles`. On planes, for bodies with different materials,
    /// that of a wheel without tractions.
    #[schema(nullable = true)]
    pub wheel_lowering_mm: Option<f64>,
    /// Angular velocity of the wheelset in rad/s, found for the prescribed longitudinal force; only for `profiles` with
    /// `wheelset.force_x_n`.
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Velocity of the wheelset's centre to the left in mm/s, found for the prescribed lateral force; only for `profiles` with
    /// `wheelset.force_y_n`.
    pub lateral_velocity_mm_per_s: Option<f64>,
    /// Positions and kinematics of the wheelset; only for `wheelset`. `total` then has one entry per position, and every patch belongs to
    /// one side in one position.
    pub wheelset: Option<Box<WheelsetAnswer>>,
    /// Reference point of rigid slip and moments.
    pub origin: Origin,
    /// Description of the frame.
    pub frame: String,
    /// Combined elastic constants that were used.
    pub material: CombinedMaterial,
    /// Version of the solver that computed the result.
    pub solver_version: String,
    /// Digest of the canonical case; equal cases have equal digests.
    pub case_digest: String,
    /// The parts of the case that are needed to interpret the numbers.
    pub asked: Option<Asked>,
    /// The parameters that damage was computed with; only with the output `damage`.
    pub damage_parameters: Option<Box<DamageFiguresUsed>>,
}

/// The parts of a case that are needed to interpret its result.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Asked {
    /// The `type` of the contact.
    pub contact: String,
    /// Largest coefficient of friction: no tangential traction exceeds it times the pressure.
    pub friction_coefficient: f64,
    /// Whether the coefficient is smaller in some places, because it falls with slip or varies across the contact.
    #[serde(skip_serializing_if = "std::ops::Not::not", default)]
    #[schema(required = false)]
    pub friction_varies: bool,
    /// The load; absent if the case has none.
    pub load: Option<Load>,
}

/// How the normal problem of a gap was solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct NormalReport {
    /// Cells of the finest grid along x and y; for several grids, of the one with the largest load.
    pub cells: [u32; 2],
    /// Number of grids: one per gap, or one per patch if the patches of a gap differ much in size.
    pub grids: u32,
    /// Iterations over all grids.
    pub iterations: u32,
    /// Largest violation of the contact conditions on the finest grid (distance in the contact, overlap outside), relative
    /// to the deepest overlap of the undeformed surfaces.
    pub residual: f64,
    /// Largest pressure on the last grid but one divided by that on the last, minus 1; 0 if there was only one grid.
    pub pressure_change: f64,
    /// For a wheel on a rail: relative difference between the prescribed force and the force at the last height, before scaling to the
    /// prescribed force by Hertz's laws; 0 if no height was searched for.
    pub force_residual: f64,
    /// Wall time in s.
    pub seconds: f64,
}

impl NormalReport {
    /// Combines the reports of two parts of a contact: the finer grid, the sum of the work, the larger residual.
    #[must_use]
    pub fn with(self, other: NormalReport) -> NormalReport {
        let changes = [self.pressure_change, other.pressure_change];
        NormalReport {
            cells: self.cells.max(other.cells),
            grids: self.grids + other.grids,
            iterations: self.iterations + other.iterations,
            residual: self.residual.max(other.residual),
            pressure_change: match changes[0].abs() >= changes[1].abs() {
                true => changes[0],
                false => changes[1],
            },
            force_residual: self.force_residual.max(other.force_residual),
            seconds: self.seconds + other.seconds,
        }
    }
}

/// Reference point of moments and rigid slip.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct Origin {
    /// x in mm, in the coordinates of the answer.
    pub x_mm: f64,
    /// y in mm.
    pub y_mm: f64,
    /// What this point is.
    pub meaning: String,
}

/// Elastic constants of the pair: 1/G = ½(1/G₁ + 1/G₂), ν/G = ½(ν₁/G₁ + ν₂/G₂), K as Kalker 1990, eq. 1.44.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct CombinedMaterial {
    /// Combined shear modulus G in MPa.
    pub shear_modulus_mpa: f64,
    /// Combined Poisson's ratio ν.
    pub poisson_ratio: f64,
    /// Difference parameter K; 0 for like bodies.
    pub difference_parameter: f64,
}

/// A patch under one motion, or at one position of a wheelset.
#[derive(Debug, Clone, Copy)]
pub struct PatchPoint<'a> {
    /// Index of the patch.
    pub number: usize,
    /// The patch.
    pub patch: &'a PatchSolution,
    /// Its results under the motion.
    pub point: &'a PointSolution,
    /// Its region and pressure under the motion.
    pub region: MotionRegion,
}

impl Solution {
    /// Returns the position of the wheelset to which a patch belongs; `None` without a wheelset.
    #[must_use]
    pub fn position_of(&self, patch: usize) -> Option<usize> {
        let positions = self.wheelset.as_deref()?.positions.iter();
        let mut wheels = positions.map(|position| [&position.left, &position.right]);
        wheels.position(|both| both.iter().any(|wheel| wheel.patches.contains(&patch)))
    }

    /// Returns the patches under a motion, or at a position of a wheelset. Each position has its own patches.
    pub fn at(&self, motion: usize) -> impl Iterator<Item = PatchPoint<'_>> + Clone {
        let patches = self.patches.iter().enumerate();
        patches.filter_map(move |(number, patch)| {
            let point = match self.position_of(number) {
                None => patch.points.get(motion),
                Some(position) => patch.points.first().filter(|_| position == motion),
            };
            let point = point?;
            let region = point.region.as_deref().copied();
            Some(PatchPoint {
                number,
                patch,
                point,
                region: region.unwrap_or_else(|| patch.region()),
            })
        })
    }
}

/// One contact patch with its results for every motion. Where motions change region and pressure, its values are those of the first motion;
/// every point has its own in `region`.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct PatchSolution {
    /// Normal force in N.
    pub normal_force_n: f64,
    /// The largest tangential force that friction allows, in N.
    pub friction_limit_n: Option<f64>,
    /// Approach of distant points in mm; absent if the pressure was given.
    #[schema(nullable = true)]
    pub approach_mm: Option<f64>,
    /// Contact area in mm².
    pub area_mm2: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Semi-axes along x and y in mm; only for elliptic patches.
    #[schema(nullable = true)]
    pub semi_axes_mm: Option<[f64; 2]>,
    /// Extent of the patch `[x_min, x_max, y_min, y_max]` in mm.
    pub extent_mm: [f64; 4],
    /// Position of the patch on wheel and rail; only for `profiles`.
    #[schema(nullable = true)]
    pub position: Option<Position>,
    /// Quality of the profile points under the patch; only for `profiles`.
    #[schema(nullable = true)]
    pub quality: Option<PatchQuality>,
    /// One entry per motion, in the order of the case.
    pub points: Vec<PointSolution>,
}

impl PatchSolution {
    /// Returns its region and pressure under the first motion.
    #[must_use]
    pub fn region(&self) -> MotionRegion {
        MotionRegion {
            normal_force_n: self.normal_force_n,
            friction_limit_n: self.friction_limit_n,
            approach_mm: self.approach_mm,
            area_mm2: self.area_mm2,
            pressure_max_mpa: self.pressure_max_mpa,
            extent_mm: self.extent_mm,
        }
    }
}

/// Position of the load centre of a patch on wheel and rail, and the frame of the patch's coordinates.
///
/// Track axes: x along rolling, y to the left from the middle of the track, z up from the top of the rail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Position {
    /// The load centre in track axes, `[x, y, z]` in mm.
    pub track_mm: [f64; 3],
    /// The load centre on the rail's cross-section, `[y, z]` in mm, y to the field side and z down.
    pub rail_mm: [f64; 2],
    /// The load centre on the wheel's cross-section, in the same form.
    pub wheel_mm: [f64; 2],
    /// Rotation about x from the track axes to those of the patch, in rad: its normal is `(0, −sin, cos)` of this angle.
    pub contact_angle_rad: f64,
    /// Radius of the wheel at the load centre in mm.
    pub rolling_radius_mm: f64,
    /// Origin of the patch's coordinates in track axes, `[x, y, z]` in mm: the load centre of the neighbouring patches that share these
    /// coordinates, usually of one patch.
    pub origin_track_mm: [f64; 3],
}

/// Tangential solution of one patch for one motion.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct PointSolution {
    /// The motion of this point.
    pub motion: Motion,
    /// The same motion in the dimensionless form of the literature.
    pub normalised: NormalisedMotion,
    /// Longitudinal force on the lower body in N.
    pub force_x_n: f64,
    /// Lateral force on the lower body in N.
    pub force_y_n: f64,
    /// Moment about the origin on the lower body in N·mm.
    pub moment_z_n_mm: f64,
    /// Estimated absolute errors of the three resultants; null if they cannot be estimated.
    #[or_null]
    pub error_estimate: Option<ErrorEstimate>,
    /// Force of the patch on the lower body in track axes, `[x, y, z]` in N, including the normal force; only for `profiles` and
    /// `wheelset`. On the curve of a rail, pressures and tractions have several directions, so the force does not follow from
    /// `normal_force_n` and the contact angle.
    pub force_track_n: Option<[f64; 3]>,
    /// Uncertainty due to the measured profiles; only for `profiles`.
    #[schema(nullable = true)]
    pub profile_uncertainty: Option<ProfileUncertainty>,
    /// Area that sticks in mm²; absent unless zones were requested. The method `table` always gives it, accurate to some hundredths of the
    /// area.
    #[schema(nullable = true)]
    pub stick_area_mm2: Option<f64>,
    /// Area that slips in mm²; absent unless zones were requested, except for `table`.
    #[schema(nullable = true)]
    pub slip_area_mm2: Option<f64>,
    /// Derivatives of the three resultants; absent unless requested.
    pub gradients: Option<Box<Gradients>>,
    /// Number of cells that stick; absent unless zones were requested.
    #[schema(nullable = true)]
    pub stick_cells: Option<u32>,
    /// Number of cells that slip; absent unless zones were requested.
    #[schema(nullable = true)]
    pub slip_cells: Option<u32>,
    /// Largest tangential traction in MPa; absent without a mesh.
    pub traction_max_mpa: Option<f64>,
    /// Tγ: dissipated power divided by rolling speed, ν_x F_x + ν_y F_y + φ M_z, in N (J/m). For a history it is the sum over the cells at
    /// this point, because the elastic energy also changes; it is 0 for a shift.
    pub friction_power_n: f64,
    /// |ν_x F_x| + |ν_y F_y| in N with the creepages at the load centre, the form that damage models use.
    pub friction_power_without_spin_n: f64,
    /// How this point was computed.
    pub solver: SolverReport,
    /// Whether the error estimate, without the part that no mesh reduces, meets the target; absent with an explicit mesh.
    #[schema(nullable = true)]
    pub target_met: Option<bool>,
    /// Whether a prescribed force could not be reached.
    pub saturated: bool,
    /// Additional values of a history: distance, shifts and dissipated energy; only for `motion.history`.
    pub history: Option<HistoryPoint>,
    /// Summary of the stresses below the surface; only with the output `subsurface`.
    pub subsurface: Option<SubsurfaceSummary>,
    /// Damage of one pass; only with the output `damage`.
    pub damage: Option<Box<Damage>>,
    /// Summary of the temperatures; only with the output `temperature`.
    pub temperature: Option<TemperatureSummary>,
    /// Region and pressure under this motion; only where several motions change them: bodies with different materials, wheels on a rail.
    pub region: Option<Box<MotionRegion>>,
}

/// Contact region and pressure of a patch under one motion.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct MotionRegion {
    /// Normal force in N.
    pub normal_force_n: f64,
    /// The largest tangential force that friction allows, in N.
    pub friction_limit_n: Option<f64>,
    /// Approach of distant points in mm.
    pub approach_mm: Option<f64>,
    /// Contact area in mm².
    pub area_mm2: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Extent `[x_min, x_max, y_min, y_max]` in mm.
    pub extent_mm: [f64; 4],
}

/// A point of a history.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct HistoryPoint {
    /// Distance rolled since the start in mm.
    pub distance_mm: f64,
    /// Displacement of the upper body relative to the lower one along x since the previous point, in mm; only if the bodies did not roll.
    pub shift_x_mm: Option<f64>,
    /// Displacement along y, as `shift_x_mm`.
    pub shift_y_mm: Option<f64>,
    /// Rotation about z in rad; only if the bodies did not roll.
    pub turn_rad: Option<f64>,
    /// Estimated absolute error of `creepage_x`; only if its force was prescribed.
    pub creepage_x_error: Option<f64>,
    /// Estimated absolute error of `creepage_y`; only if its force was prescribed.
    pub creepage_y_error: Option<f64>,
    /// Estimated absolute error of `shift_x_mm`; only if its force was prescribed.
    pub shift_x_error_mm: Option<f64>,
    /// Estimated absolute error of `shift_y_mm`; only if its force was prescribed.
    pub shift_y_error_mm: Option<f64>,
    /// Energy dissipated by friction in this patch since the start, in N·mm.
    pub dissipated_n_mm: f64,
}

/// Creepages and spin made dimensionless with c = √(A/π) of the patch (√(ab) for an ellipse).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct NormalisedMotion {
    /// E c² ν_x / (μN(1−ν²)); absent without friction.
    pub creepage_x: Option<f64>,
    /// E c² ν_y / (μN(1−ν²)); absent without friction.
    pub creepage_y: Option<f64>,
    /// E c³ φ / (μN(1−ν²)); absent without friction.
    pub spin: Option<f64>,
    /// The length c in mm.
    pub length_mm: f64,
}

/// Absolute errors, each in the unit of its quantity.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct ErrorEstimate {
    /// Error of `force_x_n` in N.
    pub force_x_n: f64,
    /// Error of `force_y_n` in N.
    pub force_y_n: f64,
    /// Error of `moment_z_n_mm` in N·mm.
    pub moment_z_n_mm: f64,
}

impl ErrorEstimate {
    /// Returns the estimate for a sum, whose error is at most the sum of the errors.
    pub(crate) fn plus(self, other: ErrorEstimate) -> ErrorEstimate {
        ErrorEstimate {
            force_x_n: self.force_x_n + other.force_x_n,
            force_y_n: self.force_y_n + other.force_y_n,
            moment_z_n_mm: self.moment_z_n_mm + other.moment_z_n_mm,
        }
    }

    /// Returns the estimate with the moment about another point; `arm` is the distance `[x, y]` in mm of the present point from it.
    pub(crate) fn moved(self, arm: [f64; 2]) -> ErrorEstimate {
        let [by_y, by_x] = [arm[0].abs() * self.force_y_n, arm[1].abs() * self.force_x_n];
        ErrorEstimate {
            moment_z_n_mm: self.moment_z_n_mm + by_y + by_x,
            ..self
        }
    }
}

/// Derivatives of the resultants of a patch with respect to `[creepage_x, creepage_y, spin_per_mm]`, at constant region and pressure: the
/// creep coefficients.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct Gradients {
    /// Derivatives of `force_x_n`, in N, N and N·mm.
    pub force_x_n: [f64; 3],
    /// Derivatives of `force_y_n`, in N, N and N·mm.
    pub force_y_n: [f64; 3],
    /// Derivatives of `moment_z_n_mm`, in N·mm, N·mm and N·mm².
    pub moment_z_n_mm: [f64; 3],
    /// Derivatives of the three resultants with respect to the normal force at constant creepages: dimensionless, dimensionless and in mm.
    /// Only for Hertz contacts of like bodies with a constant coefficient and no layer, whose patch grows with the load.
    pub by_normal_force: Option<[f64; 3]>,
    /// Estimated absolute errors; absent for the method `table`.
    pub error_estimate: Option<GradientErrors>,
}

/// Absolute errors of gradients, each in the unit of its quantity.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct GradientErrors {
    /// Errors of `force_x_n`.
    pub force_x_n: [f64; 3],
    /// Errors of `force_y_n`.
    pub force_y_n: [f64; 3],
    /// Errors of `moment_z_n_mm`.
    pub moment_z_n_mm: [f64; 3],
    /// Errors of `by_normal_force`.
    pub by_normal_force: Option<[f64; 3]>,
}

/// How a point was computed.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct SolverReport {
    /// The method that gave the resultants. With `auto` it may be `table`; values per cell are then computed by `boundary_element` on
    /// `mesh`.
    pub method: MethodName,
    /// The finest mesh: strips of this patch, cells along x in each; absent if none was needed.
    pub mesh: Option<MeshReport>,
    /// Newton iterations over all levels and rules.
    pub iterations: u32,
    /// Products of the influence matrix with a vector, over all levels and rules.
    pub products: u32,
    /// Last residual of the contact law, relative to the traction scale of the case.
    pub residual: f64,
    /// Descriptions of the solver steps that this motion did not need; empty if none.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub skipped: Vec<String>,
    /// Share of this point in the wall time, in s.
    pub seconds: f64,
}

/// The mesh that was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Finite)]
pub struct MeshReport {
    /// Strips across the patch.
    pub strips: u32,
    /// Cells along x in each strip.
    pub cells: u32,
}

/// Sums over all patches for one motion; for `profiles` in track axes, including normal forces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Total {
    /// Longitudinal force on the lower body in N.
    pub force_x_n: f64,
    /// Lateral force on the lower body in N.
    pub force_y_n: f64,
    /// Vertical force on the lower body in N, positive up, so that a wheel's load is negative; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub force_z_n: Option<f64>,
    /// Moment about the origin on the lower body in N·mm.
    pub moment_z_n_mm: f64,
    /// Estimated absolute errors; null if they cannot be estimated.
    pub error_estimate: Option<ErrorEstimate>,
    /// Uncertainty due to the measured profiles; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub profile_uncertainty: Option<ProfileUncertainty>,
}

/// The requested values per cell of all patches.
#[derive(Debug, Clone, PartialEq, Default, Finite)]
pub struct Fields {
    /// One entry per patch, in the order of [`Solution::patches`](crate::solution::words::answer::Solution::patches).
    pub patches: Vec<PatchFields>,
}

/// The values per cell of one patch for each motion, on the mesh of that motion.
#[derive(Debug, Clone, PartialEq, Default, Finite)]
pub struct PatchFields {
    /// The meshes on which the motions were solved; several motions may share one.
    pub meshes: Vec<PatchCells>,
    /// One entry per motion.
    pub points: Vec<PointFields>,
}

impl PatchFields {
    /// Returns the cells to which the values of a motion belong.
    pub fn cells(&self, point: usize) -> &PatchCells {
        &self.meshes[self.points[point].mesh]
    }
}

/// The cells of one patch, in the order of strips with increasing y, in each strip with increasing x. All vectors have one value per cell.
#[derive(Debug, Clone, PartialEq, Default, Finite)]
pub struct PatchCells {
    /// Centre of the cell along x in mm.
    pub x_mm: Vec<f64>,
    /// Centre of the cell along y in mm.
    pub y_mm: Vec<f64>,
    /// Width of the cell along x in mm.
    pub dx_mm: Vec<f64>,
    /// Width of the cell along y in mm.
    pub dy_mm: Vec<f64>,
    /// Number of the strip, counted from 0; segments of one strip share it.
    pub strip: Vec<u32>,
    /// Pressure in MPa, if requested.
    pub pressure_mpa: Option<Vec<f64>>,
}

/// The values per cell for one motion; `None` if they are not requested.
#[derive(Debug, Clone, PartialEq, Default, Finite)]
pub struct PointFields {
    /// Index of the mesh in [`PatchFields::meshes`].
    pub mesh: usize,
    /// Stick or slip.
    pub zone: Option<Vec<Zone>>,
    /// Traction on the lower body along x in MPa.
    pub traction_x_mpa: Option<Vec<f64>>,
    /// Traction on the lower body along y in MPa.
    pub traction_y_mpa: Option<Vec<f64>>,
    /// Mean slip of the cell along x, upper body relative to the lower, divided by the rolling speed. It is parallel to the traction, and the
    /// power of the cells adds up to that of the patch (see [`local_power`](crate::post::local_power)).
    pub slip_x: Option<Vec<f64>>,
    /// Mean slip along y, divided by the rolling speed.
    pub slip_y: Option<Vec<f64>>,
    /// Temperature of both surfaces at the middle of the cell in °C.
    pub temperature_c: Option<Vec<f64>>,
    /// Stresses at the requested points, as [`stored`](crate::post::subsurface::states::stored).
    pub subsurface: Option<Vec<f64>>,
}

/// State of a cell of the contact patch.
#[keyword(Named, Finite)]
pub enum Zone {
    /// No relative slip.
    Stick,
    /// The friction bound is reached and the surfaces slip.
    Slip,
}

/// Results of a wheelset in addition to its patches.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct WheelsetAnswer {
    /// One entry per position, in the order of the case.
    pub positions: Vec<WheelsetPosition>,
    /// The rigid wheelset over a range of shifts; only if `kinematics` was requested.
    pub kinematics: Option<Box<Kinematics>>,
}

/// A wheelset at rest on both rails under its load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct WheelsetPosition {
    /// Shift to the left in mm, as given.
    pub lateral_shift_mm: f64,
    /// Yaw in rad, as given.
    pub yaw_rad: f64,
    /// Roll in rad, positive from y to z (the left wheel higher), at which both wheels carry their loads.
    pub roll_rad: f64,
    /// Height of the wheelset's centre over the top of the rails in mm; its change between positions is the lift.
    pub centre_height_mm: f64,
    /// Angular velocity about the axle in rad/s, given or found.
    pub angular_velocity_rad_per_s: f64,
    /// Torque about the axle in N mm that balances the forces of the rails: the torque of a drive, negative for a brake.
    pub drive_torque_n_mm: f64,
    /// Rolling radius of the left wheel minus that of the right one in mm.
    pub radius_difference_mm: f64,
    /// The left wheel on its rail.
    pub left: WheelOnRail,
    /// The right wheel on its rail.
    pub right: WheelOnRail,
}

/// One wheel of a wheelset. Forces act on the rail, in track axes, and include normal forces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct WheelOnRail {
    /// Indices of its patches in `patches`.
    pub patches: Vec<usize>,
    /// Rolling radius in mm at the patch with the largest load.
    pub rolling_radius_mm: f64,
    /// Contact angle in rad of the patch with the largest load.
    pub contact_angle_rad: f64,
    /// Vertical displacement of the wheel below first touch, in mm.
    pub wheel_lowering_mm: f64,
    /// Force along the track, in N.
    pub force_x_n: f64,
    /// Force to the left, in N.
    pub force_y_n: f64,
    /// Upward force in N; negative under a load.
    pub force_z_n: f64,
    /// Moment about the vertical line through the middle of the track, in N mm.
    pub moment_z_n_mm: f64,
}

/// A rigid wheelset without yaw over a range of lateral shifts; lists have one entry per shift.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct Kinematics {
    /// Lateral shifts to the left in mm. The list ends where a wheel leaves its rail or touches at the end of a cross-section.
    pub lateral_shift_mm: Vec<f64>,
    /// Roll in rad at which both wheels touch; null where there is none.
    pub roll_rad: Vec<Option<f64>>,
    /// Height of the wheelset's centre over the top of the rails in mm, with roll; null where `roll_rad` is null.
    pub centre_height_mm: Vec<Option<f64>>,
    /// Δr of EN 15302, in mm: rolling radius of the left wheel minus that of the right one, with a level axle.
    pub radius_difference_mm: Vec<f64>,
    /// Δr in mm with roll; null where `roll_rad` is null.
    #[serde(default)]
    pub radius_difference_with_roll_mm: Vec<Option<f64>>,
    /// Deprecated name of `radius_difference_mm`.
    pub radius_difference_without_roll_mm: Vec<f64>,
    /// Change of Δr under a smoother interpolation of the cross-sections, in mm.
    pub profile_uncertainty_mm: Vec<f64>,
    /// Contact points of the left wheel, with a level axle.
    pub left: TouchLine,
    /// Contact points of the right wheel, with a level axle.
    pub right: TouchLine,
    /// Shift in mm nearest to 0 at which Δr rises through 0: the position of a free wheelset on straight track; if Δr is 0 at several
    /// shifts, their middle. Absent if there is none.
    pub equilibrium_shift_mm: Option<f64>,
    /// Change of `equilibrium_shift_mm` under a smoother interpolation of the cross-sections, in mm.
    pub equilibrium_uncertainty_mm: Option<f64>,
    /// Lateral distance between the two contact points in mm, at the shift nearest to the equilibrium, or to 0 if there is no equilibrium.
    pub contact_distance_mm: f64,
    /// Equivalent conicity, one entry per amplitude of the case.
    pub conicity: Vec<EquivalentConicity>,
    /// Why the lists end early or lack values, or why there is no equilibrium.
    pub reason: Option<String>,
}

/// Contact points of a rigid wheel on its rail, one per shift.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema, Finite)]
pub struct TouchLine {
    /// Radius of the wheel at the contact point in mm.
    pub rolling_radius_mm: Vec<f64>,
    /// Contact angle in rad, with the sign of that of a patch.
    pub contact_angle_rad: Vec<f64>,
    /// y on the rail's cross-section in mm, positive to the field side.
    pub rail_y_mm: Vec<f64>,
    /// y on the wheel's cross-section in mm, positive to the field side.
    pub wheel_y_mm: Vec<f64>,
}

/// The equivalent conicity tan γ at one amplitude. `reason` explains every absent member.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct EquivalentConicity {
    /// Half the distance between the turning points in mm.
    pub amplitude_mm: f64,
    /// tan γ of EN 15302, by integration of the wheelset's equation of motion with Δr of the level axle; 0 if Δr is 0 over the whole
    /// amplitude.
    pub conicity: Option<f64>,
    /// tan γ from Δr with roll. For a cone, roll adds some percent to the cone's own tangent.
    pub conicity_with_roll: Option<f64>,
    /// Deprecated name of `conicity`.
    pub conicity_without_roll: Option<f64>,
    /// tan γ by harmonic linearisation of Δr between the same turning points.
    pub conicity_harmonic: Option<f64>,
    /// Error of `conicity` due to the step between shifts.
    pub error_estimate: Option<f64>,
    /// Change of `conicity` under a smoother interpolation of the cross-sections.
    pub profile_uncertainty: Option<f64>,
    /// Wavelength of the motion in mm.
    pub wavelength_mm: Option<f64>,
    /// Shifts in mm at which the motion reverses.
    pub turns_mm: Option<[f64; 2]>,
    /// Why members are absent.
    pub reason: Option<String>,
}

/// How a case was interpreted, without solving it.
#[none_is_absent(nullable)]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Understanding {
    /// The patches, if known beforehand: by Hertz's formulas for `radii` and `ellipse`, from the grid for `pressure_grid`. Otherwise empty.
    pub patches: Vec<KnownPatch>,
    /// Friction coefficient times normal force in N, which no tangential force can exceed; absent if the normal force must be computed.
    pub friction_limit_n: Option<f64>,
    /// Position of wheel and rail; only for `profiles`.
    pub placement: Option<PlacedProfiles>,
}

/// A patch that is known before solving.
#[none_is_absent(nullable)]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct KnownPatch {
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Approach of distant points in mm; absent if the pressure was given.
    pub approach_mm: Option<f64>,
    /// Contact area in mm².
    pub area_mm2: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Semi-axes along x and y in mm; only for elliptic patches.
    pub semi_axes_mm: Option<[f64; 2]>,
    /// Extent of the patch `[x_min, x_max, y_min, y_max]` in mm.
    pub extent_mm: [f64; 4],
}

/// Cross-sections of rail and wheel in track axes, `[y, z]` in mm: y to the left from the middle of the track, z up from the top of the
/// rail. Both are rotated, shifted and smoothed as in the solution; coordinates are rounded to 0.0001 mm.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PlacedProfiles {
    /// The rail.
    pub rail_mm: Vec<[f64; 2]>,
    /// The wheel at the height of first touch, projected along x. Each point of the profile is shown where the surface of its circle has no
    /// slope along x, or else below the axle. Without yaw this is the section through the axle.
    pub wheel_mm: Vec<[f64; 2]>,
    /// Where the wheel touches first when it is lowered onto the rail.
    pub first_touch: FirstTouch,
    /// Estimated vertical displacement of the wheel below first touch, in mm; the result has the computed `wheel_lowering_mm`.
    pub lowering_estimate_mm: f64,
}

/// The point of first touch of a wheel on a rail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct FirstTouch {
    /// The point in track axes, `[x, y, z]` in mm; x differs from 0 if the wheelset is yawed.
    pub track_mm: [f64; 3],
    /// The point on the rail's cross-section, `[y, z]` in mm, y to the field side and z down.
    pub rail_mm: [f64; 2],
    /// The point on the wheel's cross-section, in the same form.
    pub wheel_mm: [f64; 2],
    /// Inclination of the surfaces at the point in rad, as `contact_angle_rad` of a patch.
    pub contact_angle_rad: f64,
}

/// How a solve time was determined.
#[keyword]
pub enum FoundBy {
    /// The case was solved.
    Solve,
    /// The case was solved up to an error, with which a job would end as well.
    FailedSolve,
    /// The solve had begun when the time ran out.
    PartOfSolve,
    /// Nothing was solved.
    Formulas,
}
