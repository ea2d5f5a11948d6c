//! The question as the client writes it: words and units in the names, no arithmetic.
//!
//! A [`Case`] is only ever made by [`Case::read`](crate::contact::case::words::Case::read), which collects every fault of the
//! JSON text at once. Lengths in mm, forces in N, stresses in MPa, creepages dimensionless, spin in 1/mm.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::contact::geometry::formats::format::Format;
use crate::contact::geometry::wheel_rail::Side;

/// One contact case: two bodies, how they are pressed together and how they roll.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Case {
    /// Free text for people, at most 200 characters, none of them a control character.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub name: Option<String>,
    /// Free key–value pairs to find the case again, at most 32 of them, without control characters; no key has a colon.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(required = false)]
    pub labels: BTreeMap<String, String>,
    /// Elastic constants of the two bodies.
    pub material: Material,
    /// Coulomb friction.
    pub friction: Friction,
    /// Where and how the bodies touch.
    pub contact: Contact,
    /// How hard they are pressed together; needed unless the contact carries its own pressure.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub load: Option<Load>,
    /// One motion, a list of motions, or a sweep.
    pub motion: Motions,
    /// Method and accuracy; `{"method": "auto", "target_error": 0.005}` when left out.
    #[schema(required = false)]
    pub solver: Solver,
    /// What to compute; `["resultants", "zones"]` when left out.
    #[schema(required = false)]
    pub outputs: Vec<Output>,
}

/// Elastic constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Material {
    /// Both bodies are of the same material.
    Same(Elastic),
    /// The bodies differ; they are combined as in quasi-identical contact.
    Pair {
        /// The lower body (body 2, the rail).
        lower: Elastic,
        /// The upper body (body 1, the wheel).
        upper: Elastic,
    },
}

/// Isotropic linear elasticity. Exactly one of the two moduli is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Elastic {
    /// Shear modulus G in MPa, more than 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub shear_modulus_mpa: Option<f64>,
    /// Young's modulus E in MPa, more than 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub young_modulus_mpa: Option<f64>,
    /// Poisson's ratio, 0 to 0.5.
    #[schema(minimum = 0.0, maximum = 0.5)]
    pub poisson_ratio: f64,
}

/// Coulomb friction with one coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Friction {
    /// Friction coefficient: 0 (frictionless), or 1e-12 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub coefficient: f64,
}

/// Where the bodies touch.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Contact {
    /// Relative radii of curvature: an elliptic patch after Hertz.
    Radii {
        /// Relative radius in the rolling direction, in mm.
        #[schema(exclusive_minimum = 0.0)]
        rolling_mm: f64,
        /// Relative radius across the rolling direction, in mm.
        #[schema(exclusive_minimum = 0.0)]
        lateral_mm: f64,
    },
    /// An elliptic patch with Hertz's pressure.
    Ellipse {
        /// Semi-axis along the rolling direction, in mm.
        #[schema(exclusive_minimum = 0.0)]
        a_mm: f64,
        /// Semi-axis across the rolling direction, in mm.
        #[schema(exclusive_minimum = 0.0)]
        b_mm: f64,
    },
    /// A gap measured across the rolling direction between bodies that are circular along it:
    /// `x²/(2 rolling_mm) + gap(y)`. Region and pressure are found.
    GapProfile {
        /// Relative radius in the rolling direction, in mm.
        #[schema(exclusive_minimum = 0.0)]
        rolling_mm: f64,
        /// Strictly increasing coordinates across, in mm.
        y_mm: Vec<f64>,
        /// Distance of the undeformed surfaces at `y_mm` and x = 0, in mm; any constant may be added.
        gap_mm: Vec<f64>,
    },
    /// Any gap on a grid. Region and pressure are found; outside the grid there is no contact.
    GapGrid {
        /// Strictly increasing coordinates along the rolling direction, in mm.
        x_mm: Vec<f64>,
        /// Strictly increasing coordinates across, in mm.
        y_mm: Vec<f64>,
        /// Distance of the undeformed surfaces, in mm: `gap_mm[j][i]` at `(x_mm[i], y_mm[j])`; any constant may be added.
        gap_mm: Vec<Vec<f64>>,
    },
    /// A given pressure on a grid; its positive part is the contact region, which may have several patches.
    PressureGrid {
        /// Strictly increasing coordinates along the rolling direction, in mm.
        x_mm: Vec<f64>,
        /// Strictly increasing coordinates across, in mm.
        y_mm: Vec<f64>,
        /// `pressure_mpa[j][i]` at `(x_mm[i], y_mm[j])`, not negative, 0 outside the contact.
        pressure_mpa: Vec<Vec<f64>>,
    },
    /// A wheel on a rail, by their cross-sections. Every patch is found, and solved in a frame of its own.
    Profiles {
        /// Cross-section of the rail.
        #[schema(inline = false)]
        rail: Box<CrossSection>,
        /// Cross-section of the wheel.
        #[schema(inline = false)]
        wheel: Box<CrossSection>,
        /// Which wheel of the wheelset, seen along rolling.
        side: Side,
        /// Radius of the wheel where z of its cross-section is 0, in mm.
        #[schema(exclusive_minimum = 0.0)]
        rolling_radius_mm: f64,
        /// Distance of the gauge faces of the two rails, in mm; 1435 when left out.
        #[schema(required = false)]
        gauge_mm: f64,
        /// Depth below the top of the rail at which the gauge is measured, in mm; 14 when left out.
        #[schema(required = false)]
        gauge_height_mm: f64,
        /// Turn of the rail about the origin of its cross-section, in rad, positive with its top toward the track centre; 0
        /// when left out.
        #[schema(required = false)]
        cant_rad: f64,
        /// Distance of the backs of the two flanges, in mm; 1360 when left out.
        #[schema(required = false)]
        flange_back_distance_mm: f64,
        /// y of the back of the flange in the wheel's cross-section, in mm; -70 when left out.
        #[schema(required = false)]
        flange_back_position_mm: f64,
        /// Shift of the wheelset to the left, in mm; 0 when left out.
        #[schema(required = false)]
        lateral_shift_mm: f64,
        /// Yaw of the wheelset in rad, positive from x to y; 0 when left out.
        #[schema(required = false)]
        yaw_rad: f64,
        /// Roll of the wheelset in rad, positive from y to z; 0 when left out.
        #[schema(required = false)]
        roll_rad: f64,
        /// Solve also where the points of a profile are so coarse or rough under the contact that an answer would mislead, or where rail and
        /// wheel seem exchanged; otherwise the job fails and says where. `false` when left out.
        #[serde(skip_serializing_if = "is_false")]
        #[schema(required = false)]
        accept_rough_profiles: bool,
    },
}

/// A cross-section of a rail or a wheel, as points or as the text of a file; exactly one of the two.
///
/// y is positive to the field side and z positive down unless `mirror_y` and `mirror_z`, the file or the shape itself say otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CrossSection {
    /// Points `[y, z]` in mm, in order along the cross-section.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub points_mm: Option<Vec<[f64; 2]>>,
    /// Format of `text`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub format: Option<Format>,
    /// What the file says; its text, never a path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub text: Option<String>,
    /// y of the points is positive to the track centre. Left out, the file tells; then a wheel's flange, and a rail is as
    /// above.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub mirror_y: Option<bool>,
    /// z of the points is positive up. Left out, the file tells, then the shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub mirror_z: Option<bool>,
    /// Waves shorter than about this along the cross-section are smoothed away, in mm; 0 (none) when left out. `auto`: what suits the noise of
    /// the points and the pressure, 2 to 8 mm or none; the answer says what was used.
    #[schema(required = false)]
    pub smoothing_mm: Smoothing,
}

fn is_false(value: &bool) -> bool {
    !value
}

/// How a cross-section is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Smoothing {
    /// By a cut wavelength in mm; 0 for none.
    Length(f64),
    /// By what suits the noise and the pressure.
    ByNoise(SmoothingWord),
}

/// A smoothing that the service chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SmoothingWord {
    /// From the noise of the points and the pressure.
    Auto,
}

/// How hard the bodies are pressed together; exactly one member is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Load {
    /// Normal force in N, more than 0. For `profiles` the sum over all patches, each along its own normal.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub normal_force_n: Option<f64>,
    /// Vertical force of the wheel on the rail in N, more than 0; for `profiles` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub vertical_force_n: Option<f64>,
    /// Approach of distant points in mm. For `radii` and `ellipse` it counts from first touch and is more than 0; for gaps it
    /// counts from gap = 0 of the given data and is more than the least gap; for `profiles` the wheel is lowered by it, vertically
    /// from first touch.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub approach_mm: Option<f64>,
}

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

/// A motion as a case asks for it: creepages and spin, where a tangential force may stand in place of its creepage. The creepage that
/// gives the force is found and reported with the answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct AskedMotion {
    /// Longitudinal creepage, dimensionless; 0 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub creepage_x: Option<f64>,
    /// Lateral creepage, dimensionless; 0 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub creepage_y: Option<f64>,
    /// Spin in 1/mm.
    #[schema(required = false)]
    pub spin_per_mm: f64,
    /// Longitudinal force on the lower body in N, over all patches, at most μN. Excludes `creepage_x`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_x_n: Option<f64>,
    /// Lateral force on the lower body in N, over all patches, at most μN. Excludes `creepage_y`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_y_n: Option<f64>,
}

/// One motion, a list of motions on the same patch, or a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Motions {
    /// One motion; components left out are 0, but at least one is written.
    One(AskedMotion),
    /// Several motions on the same patch, solved in order.
    Many(Vec<AskedMotion>),
    /// Motions generated from ranges.
    Sweep {
        /// What varies, and what stays.
        sweep: Sweep,
    },
    /// The motion of the wheelset, from which every patch gets its own creepages; for `profiles` only.
    Wheelset {
        /// How the wheelset moves.
        wheelset: Wheelset,
    },
}

/// Motion of a wheelset. Exactly one of `angular_velocity_rad_per_s` and `free_rolling_radius_mm` is given.
///
/// With the speed V, the axle e, the angular velocity ω = Ω e + (roll rate, 0, yaw rate) and r from the wheelset's centre to the
/// patch, the wheel's material moves with v = (V, lateral velocity, 0) + ω × r; the creepages of a patch with the tangent t and the
/// normal n are v_x / V, v · t / V and the spin ω · n / V.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Wheelset {
    /// Speed V along x in mm/s, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_per_s: f64,
    /// Angular velocity Ω about the axle in rad/s, positive for rolling forward.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Radius in mm at which the wheel would roll freely: Ω is the speed divided by it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub free_rolling_radius_mm: Option<f64>,
    /// Velocity of the centre to the left in mm/s; 0 when left out.
    #[schema(required = false)]
    pub lateral_velocity_mm_per_s: f64,
    /// Rate of the yaw in rad/s; 0 when left out.
    #[schema(required = false)]
    pub yaw_rate_rad_per_s: f64,
    /// Rate of the roll in rad/s; 0 when left out.
    #[schema(required = false)]
    pub roll_rate_rad_per_s: f64,
}

/// Ranges of the motion's components. A component left out is 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Sweep {
    /// Longitudinal creepage.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub creepage_x: Option<Range>,
    /// Lateral creepage.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub creepage_y: Option<Range>,
    /// Spin in 1/mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub spin_per_mm: Option<Range>,
    /// Longitudinal force on the lower body in N, in place of `creepage_x`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub force_x_n: Option<Range>,
    /// Lateral force on the lower body in N, in place of `creepage_y`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub force_y_n: Option<Range>,
    /// `together` (default): all ranges have the same number of points and run side by side; `grid`: every
    /// combination, the last named component fastest, a force in the place of its creepage.
    #[schema(required = false)]
    pub combine: Combine,
}

/// How several ranges of a sweep are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// Side by side; all ranges have equally many points.
    #[default]
    Together,
    /// Every combination.
    Grid,
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

/// How to solve, and how exactly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Solver {
    /// The method.
    #[schema(required = false)]
    pub method: MethodName,
    /// Allowed error of the resultants relative to μN (moment: μN√(A/π)), 1e-4 to 0.5. Excludes `mesh`.
    ///
    /// Most cases reach 0.001, few 1e-4: one that ends above its target has `target_met: false` and the remark `target-missed`.
    /// 0.005 when left out, but for `fastsim`, whose stated error no target changes: without one it has no `target_met`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, minimum = 0.0001, maximum = 0.5)]
    pub target_error: Option<f64>,
    /// An explicit mesh instead of a target.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub mesh: Option<MeshSizeWords>,
    /// How much traction `fastsim` lets friction carry where; `elliptic` when left out. For no other method.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub traction_bound: Option<TractionBoundName>,
    /// Give up after this many seconds of solving.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub time_limit_s: Option<f64>,
}

/// The methods a client can choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = Method)]
pub enum MethodName {
    /// The best method for the case (today always `boundary_element`).
    #[default]
    Auto,
    /// Semismooth Newton on the projected equations, strip-preconditioned GMRES.
    BoundaryElement,
    /// The method of Liu and Hsu: Newton–Raphson with two initial guesses.
    LiuHsu,
    /// Kalker's simplified theory: a draft in microseconds.
    Fastsim,
}

/// Where `fastsim` lets tractions slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = TractionBound)]
pub enum TractionBoundName {
    /// At μ times the pressure, for an ellipse Hertz's semi-ellipsoid.
    #[default]
    Elliptic,
    /// At the square of the pressure, scaled to carry the same μN: for an ellipse Kalker's paraboloid, 4/3 as high in the middle.
    Parabolic,
}

/// An explicit mesh: equal strips, cosine-graded cells along x, no clustering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = MeshSize)]
pub struct MeshSizeWords {
    /// Strips across each patch.
    #[schema(minimum = 1)]
    pub strips: u32,
    /// Cells along x in each strip.
    #[schema(minimum = 1)]
    pub cells: u32,
}

/// What a case may ask for; nothing else is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// Forces, moment, dissipated power.
    Resultants,
    /// Stick and slip zones: cells, areas, outlines.
    Zones,
    /// Tractions per cell.
    Tractions,
    /// Pressure per cell.
    Pressure,
    /// Slip per cell.
    Slip,
}
