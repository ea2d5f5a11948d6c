//! Where stresses below the surface are asked for.
//!
//! Which damage models a case asks for, and with which figures.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Where stresses below the surface are asked for, in the axes of the patch: x along rolling, y to the left, depth positive into the
/// body. At most one of `points_mm`, `along_depth_at_mm` and `plane`; without any, only the worst point is found.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Subsurface)]
pub struct SubsurfaceWords {
    /// Points `[x, y, depth]` in mm.
    pub points_mm: Option<Vec<[f64; 3]>>,
    /// The line straight down from `[x, y]` in mm, or below the `"worst"` point of the patch; needs `depths_mm`.
    pub along_depth_at_mm: Option<DepthLineAt>,
    /// Depths on that line in mm.
    pub depths_mm: Option<Vec<f64>>,
    /// A grid of points, usually in a plane.
    pub plane: Option<StressGrid>,
    /// The body: `lower` when left out.
    #[schema(required = false)]
    pub body: BodyName,
    /// Find the point of every patch where von Mises' stress is largest; `true` when left out.
    #[schema(required = false)]
    pub worst: bool,
    /// Judge what a point of the body lives through while the contact rolls over it: Dang Van's criterion and shakedown.
    pub passage: Option<PassageWords>,
}

/// What is judged of a passage of the contact in steady rolling: shakedown always, Dang Van's criterion with its slope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = Passage)]
pub struct PassageWords {
    /// Weight of the hydrostatic stress in Dang Van's criterion, a property of the steel; without it the criterion is not evaluated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, minimum = 0, maximum = 10)]
    pub dang_van_slope: Option<f64>,
}

/// Where a line of depths begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum DepthLineAt {
    /// At `[x, y]` in mm.
    Place([f64; 2]),
    /// At a point that is found.
    Found(FoundPlace),
}

/// A point that is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FoundPlace {
    /// Where von Mises' stress is largest.
    Worst,
}

/// The product of three axes, x fastest, then y, then depth; for a plane one of them is a single number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StressGrid {
    /// x in mm.
    pub x_mm: GridAxis,
    /// y in mm.
    pub y_mm: GridAxis,
    /// Depths in mm.
    pub depths_mm: GridAxis,
}

/// Coordinates along one axis: a number, a list, or equally spaced ones `{ "from", "to", "points" }`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum GridAxis {
    /// One coordinate.
    One(f64),
    /// As listed.
    List(Vec<f64>),
    /// Equally spaced, both ends included.
    Spaced {
        /// First coordinate.
        from: f64,
        /// Last coordinate.
        to: f64,
        /// Number of coordinates, at least 2.
        #[schema(minimum = 2)]
        points: u32,
    },
}

/// One of the two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = Body)]
pub enum BodyName {
    /// Body 2, the rail.
    #[default]
    Lower,
    /// Body 1, the wheel.
    Upper,
}

/// Which damage models are evaluated, and with which figures.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Damage)]
pub struct DamageWords {
    /// Models to evaluate. When left out: `t_gamma` and `usfd_wear`, the models whose parameters are confirmed.
    #[schema(required = false)]
    pub models: Vec<DamageModel>,
    /// The name of a set of figures, or figures in place of some of the default set's.
    pub parameters: Option<DamageParameterWords>,
    /// Wear strip by strip across the patch, from the power of every cell, beside that of the patch as a whole; `false` when left out.
    #[schema(required = false)]
    pub across: bool,
}

/// A damage model.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema, Words,
)]
#[serde(rename_all = "snake_case")]
pub enum DamageModel {
    /// Friction power over rolling speed, with and without spin.
    TGamma,
    /// Wear by the power per area (University of Sheffield).
    UsfdWear,
    /// Wear by Archard's law with a map of coefficients (KTH). Needs `speed_mm_per_s` in the motion.
    ArchardWear,
    /// Rolling contact fatigue by the Whole Life Rail Model.
    Wlrm,
    /// Surface fatigue index.
    SurfaceFatigueIndex,
    /// Place on the shakedown map.
    Shakedown,
}

/// The name of a set, or figures of the client's.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum DamageParameterWords {
    /// A named set: `900a-r8t-1`.
    Named(DamageSetName),
    /// Figures in place of the default set's.
    Own(Box<OwnDamageFigures>),
}

/// Named sets of figures; a set that is changed gets another name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
pub enum DamageSetName {
    /// Rail UIC 900A, wheel R8T.
    #[default]
    #[serde(rename = "900a-r8t-1")]
    Rail900aWheelR8t,
}

/// Figures of the client's; those left out are the default set's.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema)]
pub struct OwnDamageFigures {
    /// Density of the worn material in kg/m³.
    #[schema(exclusive_minimum = 0.0)]
    pub density_kg_per_m3: Option<f64>,
    /// Yield stress in shear in MPa, of the surface fatigue index and the shakedown map.
    #[schema(exclusive_minimum = 0.0)]
    pub shear_yield_mpa: Option<f64>,
    /// Hardness of the worn material in MPa, of Archard's law.
    #[schema(exclusive_minimum = 0.0)]
    pub hardness_mpa: Option<f64>,
    /// The wear map of the University of Sheffield.
    pub usfd: Option<UsfdFigures>,
    /// The map of Archard's coefficients.
    pub archard: Option<ArchardFigures>,
    /// The damage function of the Whole Life Rail Model.
    pub wlrm: Option<WlrmFigures>,
}

/// Wear rate over power per area x in N/mm²: proportional to x, then constant, then rising again; without steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UsfdFigures {
    /// Rate over x where wear is mild, in µg/(m mm²) per N/mm².
    pub mild_slope: f64,
    /// Mild up to this x in N/mm².
    pub mild_until: f64,
    /// Severe, with the rate reached there, up to this x in N/mm².
    pub severe_until: f64,
    /// Slope of the rate beyond.
    pub catastrophic_slope: f64,
}

/// Archard's coefficients, each as the range `[low, high]` that measurements leave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ArchardFigures {
    /// Of mild wear, below the first and above the second sliding speed.
    pub mild: [f64; 2],
    /// Of severe wear, between them.
    pub severe: [f64; 2],
    /// Of seizure, where the pressure exceeds its limit.
    pub seizure: [f64; 2],
    /// The two sliding speeds in mm/s.
    pub speeds_mm_per_s: [f64; 2],
    /// Seizure from this pressure over hardness on.
    pub seizure_pressure: f64,
}

/// Damage of one pass over Tγ without spin: 0 up to a threshold, linear to a peak, linear down to 0 and on below it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WlrmFigures {
    /// No damage up to this Tγ in N.
    pub threshold_n: f64,
    /// Most damage at this Tγ in N.
    pub peak_at_n: f64,
    /// Wear outweighs fatigue from this Tγ on, in N.
    pub zero_at_n: f64,
    /// Damage of one pass at the peak; 1 is a visible crack.
    pub peak: f64,
}
