//! Where the bodies touch, and how hard they are pressed together.
//!
//! Elastic and thermal constants of the bodies.
//!
//! Friction between the bodies, and what lies between them.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::contact::case::words::motion::{Combine, Swept};

/// Where the bodies touch.
#[none_is_absent]
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
    /// A given pressure on a grid; its positive part is the contact region, which may have several patches. It is kept as it stands, also where
    /// the bodies differ, so that it has to contain what tractions do to it.
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
        /// The side of the wheel in its wheelset, seen in the rolling direction.
        side: SideName,
        /// Radius of the wheel where z of its cross-section is 0, in mm.
        #[schema(exclusive_minimum = 0.0)]
        rolling_radius_mm: f64,
        /// Distance of the gauge faces of the two rails, in mm; 1435 when left out.
        gauge_mm: Option<f64>,
        /// Depth at which the gauge is measured, below the highest point of the rail as it lies, in mm; 14 when left out.
        gauge_height_mm: Option<f64>,
        /// Distance of the origin of the rail's cross-section from the middle of the track, in mm. It places the rail instead of the gauge.
        #[schema(minimum = 0.0)]
        rail_origin_mm: Option<f64>,
        /// Turn of the rail about the origin of its cross-section, in rad, positive with its top toward the track centre; 0
        /// when left out.
        #[schema(required = false)]
        cant_rad: f64,
        /// Distance of the backs of the two flanges, in mm; 1360 when left out.
        #[schema(required = false)]
        flange_back_distance_mm: f64,
        /// y of the back of the flange in the wheel's cross-section, in mm. When left out it is found from the points; -70 where they agree with
        /// that or show no flange.
        flange_back_position_mm: Option<f64>,
        /// Shift of the wheelset to the left, in mm; 0 when left out.
        #[schema(required = false)]
        lateral_shift_mm: f64,
        /// Yaw of the wheelset in rad, positive from x to y; 0 when left out.
        #[schema(required = false)]
        yaw_rad: f64,
        /// Roll of the wheelset in rad, positive from y to z; 0 when left out.
        #[schema(required = false)]
        roll_rad: f64,
        /// Solve even if the points of a profile are so coarse or rough under the contact that an answer would mislead, or if rail and wheel
        /// seem exchanged. When `false` or left out, the job fails in these cases and says where the fault is.
        #[serde(skip_serializing_if = "is_false")]
        #[schema(required = false)]
        accept_rough_profiles: bool,
        /// The surface on which the contact is solved. When left out, the curve where it can be solved, else planes with the remark `on-planes`.
        reference_surface: Option<SurfaceName>,
        /// How cells of a curved surface act on each other; not with `reference_surface: "plane"`, `angle_corrected` when left out.
        influence: Option<InfluenceName>,
    },
    /// A wheelset on both rails of a track, by their cross-sections. Its roll and its height are found, and every patch of both wheels.
    Wheelset {
        /// Cross-section of both rails, or of the left one where `right` has another.
        #[schema(inline = false)]
        rail: Box<CrossSection>,
        /// Cross-section of both wheels, or of the left one where `right` has another.
        #[schema(inline = false)]
        wheel: Box<CrossSection>,
        /// What differs on the right; nothing when left out.
        #[schema(inline = false)]
        right: Option<Box<RightSide>>,
        /// Radius of the wheels where z of their cross-section is 0, in mm.
        #[schema(exclusive_minimum = 0.0)]
        rolling_radius_mm: f64,
        /// Distance of the gauge faces of the two rails, in mm; 1435 when left out.
        gauge_mm: Option<f64>,
        /// Depth at which the gauge is measured, below the highest point of the rail as it lies, in mm; 14 when left out.
        gauge_height_mm: Option<f64>,
        /// Distance of the origin of the rail's cross-section from the middle of the track, in mm. It places the rail instead of the gauge.
        #[schema(minimum = 0.0)]
        rail_origin_mm: Option<f64>,
        /// Turn of each rail about the origin of its cross-section, in rad, positive with its top toward the track centre; 0
        /// when left out.
        #[schema(required = false)]
        cant_rad: f64,
        /// Distance of the backs of the two flanges, in mm; 1360 when left out.
        #[schema(required = false)]
        flange_back_distance_mm: f64,
        /// y of the back of the flange in the wheels' cross-section, in mm. When left out it is found from the points of each wheel; -70 where they
        /// agree with that or show no flange.
        flange_back_position_mm: Option<f64>,
        /// Shift of the wheelset to the left, in mm: a number, or several; 0 when left out. A shift and a yaw make a position, and every
        /// position has its own patches.
        #[schema(required = false, inline = false)]
        lateral_shift_mm: Swept,
        /// Yaw of the wheelset in rad, positive from x to y: a number, or several; 0 when left out.
        #[schema(required = false, inline = false)]
        yaw_rad: Swept,
        /// How several shifts and several yaws make positions: `together` (default) or `grid`, yaw fastest.
        #[schema(required = false)]
        combine: Combine,
        /// Asks for the difference of the rolling radii over the shift, and for the equivalent conicity.
        #[schema(inline = false)]
        kinematics: Option<KinematicsWords>,
        /// As of `profiles`.
        #[serde(skip_serializing_if = "is_false")]
        #[schema(required = false)]
        accept_rough_profiles: bool,
        /// As of `profiles`.
        reference_surface: Option<SurfaceName>,
        /// As of `profiles`.
        influence: Option<InfluenceName>,
    },
}

fn is_false(value: &bool) -> bool {
    !value
}

/// A cross-section of a rail or a wheel, as points or as the text of a file; exactly one of the two.
///
/// y is positive to the field side and z positive down, unless `mirror_y` and `mirror_z`, the shape or the format specify another sense.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CrossSection {
    /// Points `[y, z]` in order along the cross-section, in mm or in `unit`.
    pub points_mm: Option<Vec<[f64; 2]>>,
    /// Digest of a cross-section that was kept with `POST /v1/profiles`, in place of points or text.
    pub profile: Option<String>,
    /// Format of `text`.
    pub format: Option<FormatName>,
    /// The content of the file, not its path.
    pub text: Option<String>,
    /// Unit of the points or of the text. When left out it is the unit that the file names, else mm. All other lengths of a case are in mm.
    pub unit: Option<UnitName>,
    /// `true` if y of the points is positive toward the track centre. When left out, the side of the flange decides for a wheel, and the
    /// format for a rail (points: `false`, MiniProf: `true`). A wheel without a flange needs it, except in Simpack files.
    pub mirror_y: Option<bool>,
    /// `true` if z of the points is positive upward. When left out, the flange of a wheel or the head of a rail decides. Where the shape does
    /// not show it, the case is refused, except for Simpack files.
    pub mirror_z: Option<bool>,
    /// Waves along the cross-section that are shorter than about this are smoothed away, in mm; 0 (no smoothing) when left out. `auto` chooses
    /// 0, or 2 to 8 mm, by the noise of the points and the pressure; the answer says what was used.
    #[schema(required = false)]
    pub smoothing_mm: Smoothing,
}

/// What differs on the right of a wheelset or of the track; at least one member is given.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RightSide {
    /// Cross-section of the right rail.
    #[schema(inline = false)]
    pub rail: Option<Box<CrossSection>>,
    /// Cross-section of the right wheel.
    #[schema(inline = false)]
    pub wheel: Option<Box<CrossSection>>,
    /// Radius of the right wheel where z of its cross-section is 0, in mm.
    #[schema(exclusive_minimum = 0.0)]
    pub rolling_radius_mm: Option<f64>,
}

/// What is asked of the rigid wheelset over a range of shifts, without yaw.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct KinematicsWords {
    /// Largest shift to either side, in mm; 10 when left out.
    #[schema(required = false, exclusive_minimum = 0.0)]
    pub reach_mm: f64,
    /// Distance of the shifts, in mm; 0.1 when left out.
    #[schema(required = false, exclusive_minimum = 0.0)]
    pub step_mm: f64,
    /// Amplitudes in mm at which the equivalent conicity is answered; 1 to 7 when left out. That of vehicle acceptance is 3.
    #[schema(required = false)]
    pub amplitudes_mm: Vec<f64>,
}

/// How a cross-section is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Smoothing {
    /// By a cut wavelength in mm; 0 for none.
    Length(f64),
    /// By a wavelength that the service chooses.
    ByNoise(SmoothingWord),
}

/// A smoothing that the service chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SmoothingWord {
    /// From the noise of the points and the pressure.
    Auto,
}

impl Contact {
    /// Are patches found from cross-sections?
    #[must_use]
    pub fn has_profiles(&self) -> bool {
        matches!(self, Contact::Profiles { .. } | Contact::Wheelset { .. })
    }

    /// The surface of the contact and how its cells act on each other, as far as they are given.
    pub(crate) fn surface(&self) -> (Option<SurfaceName>, Option<InfluenceName>) {
        match self {
            Contact::Profiles {
                reference_surface,
                influence,
                ..
            }
            | Contact::Wheelset {
                reference_surface,
                influence,
                ..
            } => (*reference_surface, *influence),
            _ => (None, None),
        }
    }

    /// The word for `contact.type`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Contact::Radii { .. } => "radii",
            Contact::Ellipse { .. } => "ellipse",
            Contact::GapProfile { .. } => "gap_profile",
            Contact::GapGrid { .. } => "gap_grid",
            Contact::PressureGrid { .. } => "pressure_grid",
            Contact::Profiles { .. } => "profiles",
            Contact::Wheelset { .. } => "wheelset",
        }
    }
}

/// How hard the bodies are pressed together; exactly one member is given, for `wheelset` with `left_share` beside it.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct Load {
    /// Normal force in N, more than 0. For `profiles` the sum over all patches, each along its own normal.
    #[schema(exclusive_minimum = 0.0)]
    pub normal_force_n: Option<f64>,
    /// Vertical force of the wheel on the rail in N, more than 0; for `profiles` only. For `wheelset`, which needs it, that of both
    /// wheels together.
    #[schema(exclusive_minimum = 0.0)]
    pub vertical_force_n: Option<f64>,
    /// The part of the vertical force that the left wheel carries; for `wheelset` only, 0.5 when left out.
    #[schema(minimum = 0.01, maximum = 0.99)]
    pub left_share: Option<f64>,
    /// Approach of distant points in mm. For `radii` and `ellipse` it is measured from first touch and is more than 0. For gaps it is
    /// measured from gap = 0 of the data and is more than the least gap. For `profiles` it is the vertical distance by which the wheel is
    /// lowered from first touch.
    pub approach_mm: Option<f64>,
}

/// Left or right rail, seen in the rolling direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = Side)]
pub enum SideName {
    /// The rail at positive y of the track.
    Left,
    /// The rail at negative y of the track.
    Right,
}

/// The surface on which the contact of a wheel on a rail is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = ReferenceSurface)]
pub enum SurfaceName {
    /// A plane of contact for each patch, or for patches near each other: for comparison.
    Plane,
    /// The cross-section of the rail: normals, slips and influences follow the bend of its surface, and all patches of a wheel are one problem. For
    /// bodies that do not differ.
    Curve,
}

/// How cells of a curved contact surface act on each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = SurfaceInfluence)]
pub enum InfluenceName {
    /// As on a half-space with factors for the turn of the surface between them, across the whole contact.
    #[default]
    AngleCorrected,
    /// As on a half-space, among strips that touch less than 4 mm from each other: for comparison with other programs.
    HalfSpace,
}

/// A file format of cross-sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = Format)]
pub enum FormatName {
    /// Columns of numbers, the first two or those with the titles y and z, separated by blanks, commas, semicolons or tabs.
    Columns,
    /// Simpack's `.prr` (rail) and `.prw` (wheel).
    Simpack,
    /// MiniProf's `.ban` (rail) and `.whl` (wheel).
    Miniprof,
}

/// A unit of length of cross-sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = LengthUnit)]
pub enum UnitName {
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch, 25.4 mm.
    Inch,
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
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Elastic {
    /// Shear modulus G in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub shear_modulus_mpa: Option<f64>,
    /// Young's modulus E in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub young_modulus_mpa: Option<f64>,
    /// Poisson's ratio, 0 to 0.5.
    #[schema(minimum = 0.0, maximum = 0.5)]
    pub poisson_ratio: f64,
}

/// Thermal constants: one set for both bodies, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = Thermal)]
pub enum ThermalWords {
    /// Both bodies alike.
    Same(ThermalBodyWords),
    /// One set for each.
    Pair {
        /// The lower body (body 2, the rail).
        lower: ThermalBodyWords,
        /// The upper body (body 1, the wheel).
        upper: ThermalBodyWords,
    },
}

/// Thermal constants of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = ThermalBody)]
pub struct ThermalBodyWords {
    /// Heat conductivity in W/(m K); steel has about 50.
    #[schema(exclusive_minimum = 0.0)]
    pub conductivity_w_per_mk: f64,
    /// Density in kg/m³; steel has about 7850.
    #[schema(exclusive_minimum = 0.0)]
    pub density_kg_per_m3: f64,
    /// Specific heat in J/(kg K); steel has about 450.
    #[schema(exclusive_minimum = 0.0)]
    pub specific_heat_j_per_kgk: f64,
    /// Temperature before the contact in °C.
    #[schema(minimum = -273.15)]
    pub bulk_c: f64,
}

/// Coulomb friction: exactly one of `coefficient`, `law` (with `limit` and `terms`), `across`, `along` and `by_temperature`. `layer` and
/// `reduction` make the contact softer to tractions and may stand beside each of them.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema)]
pub struct Friction {
    /// Friction coefficient: 0 (frictionless), or 1e-12 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub coefficient: Option<f64>,
    /// How the coefficient falls with the speed of slip; every motion needs its `speed_mm_per_s`.
    pub law: Option<FallName>,
    /// The coefficient that is left at the highest speeds of slip, 0 to 100; with `law`.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub limit: Option<f64>,
    /// What falls: one or two terms; with `law`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false, min_items = 1, max_items = 2)]
    pub terms: Vec<FallTermWords>,
    /// A coefficient that varies across the contact.
    pub across: Option<AcrossWords>,
    /// A coefficient that varies along the track; the case needs a `history`, which rolls over it.
    pub along: Option<AlongWords>,
    /// A coefficient that falls with the temperature of the contact; the case needs `thermal` and every motion its `speed_mm_per_s`.
    pub by_temperature: Option<ByTemperatureWords>,
    /// A layer between the bodies, such as wet leaves, sand or oxides.
    pub layer: Option<LayerWords>,
    /// Kalker's reduction factor, more than 0 and at most 1: the initial slope of the creep curves is this part of that of clean bodies.
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub reduction: Option<f64>,
}

/// How a coefficient falls with the speed of slip v: with f₀ the `limit`, f₁, f₂ the `coefficient` and v₁, v₂ the
/// `half_speed_mm_per_s` of the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
pub enum FallName {
    /// f₀ + f₁ exp(−ln 2 v/v₁) + f₂ exp(−ln 2 v/v₂). Polach's μ₀((1 − A) exp(−B v) + A) is f₀ = A μ₀, f₁ = (1 − A) μ₀, v₁ = ln 2/B.
    Exponential,
    /// f₀ + f₁/(1 + v/v₁) + f₂/(1 + (v/v₂)²).
    Rational,
    /// f₀ + f₁ max(0, 1 − v/(2 v₁)) + f₂ max(0, 1 − v/(2 v₂)).
    Linear,
}

/// A part of the coefficient that falls with the speed of slip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FallTerm)]
pub struct FallTermWords {
    /// Its value at rest, 0 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    pub coefficient: f64,
    /// Speed of slip in mm/s at which half of it is left, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub half_speed_mm_per_s: f64,
}

/// A coefficient across the contact: linear between points, constant outside; two points at the same place are a jump. Exactly one of
/// `y_mm` and `angle_rad` says where the points are.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionAcross)]
pub struct AcrossWords {
    /// Places in mm, in order: y in the axes of the case; with `profiles` the y of the rail's profile.
    #[schema(min_items = 2, max_items = 1000)]
    pub y_mm: Option<Vec<f64>>,
    /// Inclinations of the rail's surface in rad, in order, positive as contact angles are; with `profiles` only.
    #[schema(min_items = 2, max_items = 1000)]
    pub angle_rad: Option<Vec<f64>>,
    /// The coefficient at each of them, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// A coefficient along the track, on which it lies still while the contact rolls over it: linear between points, constant outside; two
/// points at the same place are a jump.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionAlong)]
pub struct AlongWords {
    /// Places in mm, in order: x in the axes of the case when the history begins. After a rolled distance q the contact's x = 0 stands at q.
    #[schema(min_items = 2, max_items = 1000)]
    pub x_mm: Vec<f64>,
    /// The coefficient at each of them, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// A coefficient by the temperature of both surfaces in the contact: linear between points, constant outside. Friction heats the contact,
/// and every place has the coefficient of the temperature it reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FrictionByTemperature)]
pub struct ByTemperatureWords {
    /// Temperatures in °C, rising.
    #[schema(min_items = 2, max_items = 1000)]
    pub temperature_c: Vec<f64>,
    /// The coefficient at each of them, 1e-12 to 100, never rising.
    #[schema(min_items = 2, max_items = 1000)]
    pub coefficient: Vec<f64>,
}

/// An elastic layer between the bodies, so thin that each of its points shears by itself: the surfaces move apart by
/// thickness/modulus times the traction, beside what the bodies give. With `yield_mpa` it transmits no more than that stress, which grows with
/// the plastic displacement of the layer.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = Layer)]
pub struct LayerWords {
    /// Shear modulus in MPa, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub shear_modulus_mpa: f64,
    /// Thickness in mm, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    pub thickness_mm: f64,
    /// Shear stress in MPa at which the layer yields, more than 0; left out, it never does.
    #[schema(exclusive_minimum = 0.0)]
    pub yield_mpa: Option<f64>,
    /// Growth of that stress in MPa per mm of plastic displacement, 0 or more; 0 when left out.
    #[schema(minimum = 0.0)]
    pub hardening_mpa_per_mm: Option<f64>,
}

impl Friction {
    /// The largest coefficient.
    #[must_use]
    pub fn largest(&self) -> f64 {
        let falling = |limit: f64| limit + self.terms.iter().map(|t| t.coefficient).sum::<f64>();
        let across = self.across.iter().flat_map(|across| &across.coefficient);
        let given = self.coefficient.or_else(|| self.limit.map(falling));
        let across = across.chain(self.along.iter().flat_map(|along| &along.coefficient));
        let across = across.chain(self.by_temperature.iter().flat_map(|law| &law.coefficient));
        across.fold(given.unwrap_or(0.0), |most, value| most.max(*value))
    }

    /// What the coefficient falls with, if it falls.
    #[must_use]
    pub fn falls_with(&self) -> Option<&'static str> {
        match (self.law, &self.by_temperature) {
            (Some(_), _) => Some("slip"),
            (None, Some(_)) => Some("temperature"),
            (None, None) => None,
        }
    }

    /// The coefficient, if that is all there is.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        let softer = self.layer.is_some() || self.reduction.is_some();
        self.coefficient.filter(|_| !softer)
    }
}
