//! The answer of an evolution with the state between two steps, and the summaries of stresses and temperatures in an answer.

use railhead_macros::{Finite, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::case::words::evolution::WearLosses;
use crate::case::words::subsurface::BodyName;
use crate::remark::entry::RemarkEntry;
use crate::solution::words::damage::DamageFiguresUsed;

/// The result of an evolution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvolutionAnswer {
    /// Profiles and contact at the start, at each stored step, and before and after each event.
    pub records: Vec<EvolutionRecord>,
    /// The time at which each limit is reached, interpolated linearly between records.
    pub limits: Vec<LimitReached>,
    /// The representative states that stand for the traffic.
    pub traffic: CondensedTraffic,
    /// Number of accepted steps.
    pub steps: u32,
    /// Number of steps that were repeated with a shorter length.
    pub steps_rejected: u32,
    /// Number of contacts solved.
    pub solves: u32,
    /// The parameters that wear and damage were computed with.
    pub damage_parameters: DamageFiguresUsed,
    /// Remarks that matter to the use of the numbers.
    pub remarks: Vec<RemarkEntry>,
}

/// Progress of an evolution.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = EvolutionProgress)]
pub struct Progress {
    /// Completed share of the extent.
    pub share: f64,
    /// Traffic over the rail in million gross tonnes; absent if only the wheel wears.
    pub mgt: Option<f64>,
    /// Axle passes over the rail.
    pub axle_passes: Option<f64>,
    /// Distance rolled by the wheel in km; absent if only the rail wears.
    pub wheel_distance_km: Option<f64>,
}

/// The profiles and their contact at one time.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvolutionRecord {
    /// Progress at the time of the record.
    pub progress: Progress,
    /// Events that have taken place.
    pub events_done: u32,
    /// The rail.
    pub rail: WornBody,
    /// The wheel.
    pub wheel: WornBody,
    /// Losses relative to the sections at the start.
    pub losses: WearLosses,
    /// Equivalent conicity (EN 15302) at 3 mm of this wheel on both sides of a track of this rail; absent if it does not exist.
    pub conicity: Option<f64>,
    /// The contact over all states.
    pub contact: ContactRange,
    /// The contact in each state.
    pub states: Vec<StateContact>,
    /// Warnings of the states, each code once, with the first `state` and the `traffic_share` of all.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    #[schema(required = false)]
    pub remarks: Vec<RemarkEntry>,
}

/// A worn section. Arrays have one entry per point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct WornBody {
    /// Points `[y, z]` in mm, y to the field side and z down, as `points_mm` of a cross-section.
    pub points_mm: Vec<[f64; 2]>,
    /// Depth worn away along the normal in mm, without maintenance.
    pub depth_mm: Vec<f64>,
    /// Damage by the Whole Life Rail Model: 1 is a visible crack; limited to 0 where wear outweighs fatigue.
    pub damage: Vec<f64>,
    /// Area of the section removed by wear, in mm².
    pub worn_area_mm2: f64,
    /// Area of the section removed by grinding or turning, in mm².
    pub machined_area_mm2: f64,
    /// Uncertainty of the worn area.
    pub uncertainty: WearUncertainty,
}

/// Uncertainties of worn areas and depths by their source, relative to the worn area.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct WearUncertainty {
    /// Uncertainty of the steps, from halving each step.
    pub steps: f64,
    /// Uncertainty of the representative states, from halving each group of rows along each column.
    pub states: f64,
    /// Uncertainty of the contacts, from the error estimates of their friction power.
    pub contact: f64,
    /// Factors on worn areas that bound 90 % of the sampled wear coefficients.
    pub coefficients: [f64; 2],
}

/// The contact over all states.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct ContactRange {
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Mean of the largest pressure of each state over the traffic.
    pub pressure_mean_mpa: f64,
    /// Largest Y/Q: lateral over vertical force of the wheel.
    pub y_over_q_max: f64,
    /// Mean of Y/Q over the traffic.
    pub y_over_q_mean: f64,
    /// Mean of the friction power divided by the speed over the traffic, in N.
    pub t_gamma_mean_n: f64,
    /// Share of the traffic whose contact could not be solved; it is assumed to cause no wear.
    pub unsolved_share: f64,
}

/// The contact in one state.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct StateContact {
    /// Share of the traffic.
    pub share: f64,
    /// Y/Q.
    pub y_over_q: f64,
    /// Its patches; empty if the contact was not solved.
    pub patches: Vec<StatePatch>,
    /// Why the contact was not solved.
    pub failure: Option<String>,
}

/// A patch in a state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StatePatch {
    /// Load centre on the rail's section, `[y, z]` in mm.
    pub rail_mm: [f64; 2],
    /// Load centre on the wheel's section, in the same form.
    pub wheel_mm: [f64; 2],
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Friction power divided by the speed, in N.
    pub t_gamma_n: f64,
}

/// A traffic condensed to a few states.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct CondensedTraffic {
    /// Number of rows submitted.
    pub rows: u32,
    /// JSON pointers to the parts of the case that `values` replace.
    pub pointers: Vec<String>,
    /// The representative states.
    pub states: Vec<TrafficState>,
    /// Change of the wear distribution of rail and wheel, after spreading, when every group of rows is halved; relative to the worn area.
    pub error: [f64; 2],
}

/// A representative state of the traffic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrafficState {
    /// Share of the traffic.
    pub share: f64,
    /// Number of rows that it represents.
    pub rows: u32,
    /// Mean values of its rows, in the order of `pointers`.
    pub values: Vec<f64>,
    /// Standard deviation in mm over which the wear of the state is spread along rail and wheel, to represent the contact positions of its
    /// rows.
    pub spread_mm: [f64; 2],
}

/// The time at which a limit is reached.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LimitReached {
    /// Name of the loss, as in `limits`.
    pub loss: String,
    /// The limit in mm.
    pub limit_mm: f64,
    /// Time at which the limit is reached; absent if it is not.
    pub reached: Option<Progress>,
    /// Earliest time within the uncertainty of the loss.
    pub earliest: Option<Progress>,
    /// Latest time within the uncertainty of the loss; absent if it is not reached then.
    pub latest: Option<Progress>,
}

/// State of an evolution between two steps, on which alone the next step depends. JSON preserves it to the bit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EvolutionState {
    /// Completed share of the extent.
    pub share: f64,
    /// Share of the extent in the next step.
    pub next: f64,
    /// Whether the current time has a record.
    pub recorded: bool,
    /// Events that have taken place.
    pub events_done: u32,
    /// Friction coefficient that replaces that of the states.
    pub friction: Option<f64>,
    /// The representative states; none before the first step.
    pub traffic: CondensedTraffic,
    /// y on the wheel's section in mm of the last contact in each state.
    pub wheel_y: Vec<f64>,
    /// Rail and wheel.
    pub bodies: [BodyState; 2],
    /// Number of accepted steps.
    pub steps: u32,
    /// Number of repeated steps.
    pub rejected: u32,
    /// Number of contacts solved.
    pub solves: u32,
    /// Why the evolution ends before its extent, if it does.
    #[serde(default)]
    pub ended_early: Option<String>,
}

/// A body between two steps.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BodyState {
    /// Points at the start, as `points_mm`.
    pub start_mm: Vec<[f64; 2]>,
    /// The body in the form of a record.
    pub worn: WornBody,
    /// Worn area in mm² by regime: mild, severe, and seizure or catastrophic.
    pub regimes_mm2: [f64; 3],
    /// Sum of the differences in depth between the midpoint rule and Euler's rule at each point, in mm.
    pub step_change_mm: Vec<f64>,
    /// Uncertainty of the worn area in mm² due to the errors of the contact solutions.
    pub contact_mm2: f64,
}

/// A stress tensor in the axes of the patch: x along rolling, y to the left, z up. Tension is positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct StressTensor {
    /// σ_xx in MPa.
    pub xx: f64,
    /// σ_yy in MPa.
    pub yy: f64,
    /// σ_zz in MPa.
    pub zz: f64,
    /// σ_xy in MPa.
    pub xy: f64,
    /// σ_xz in MPa.
    pub xz: f64,
    /// σ_yz in MPa.
    pub yz: f64,
}

/// The stress at one point below the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct StressPoint {
    /// Position `[x, y, depth]` in mm, depth positive into the body.
    pub at_mm: [f64; 3],
    /// The stress tensor.
    pub stress_mpa: StressTensor,
    /// Von Mises' equivalent stress.
    pub von_mises_mpa: f64,
    /// Tresca's equivalent stress: the largest principal stress minus the smallest.
    pub tresca_mpa: f64,
    /// Principal stresses from the largest to the smallest.
    pub principal_mpa: [f64; 3],
    /// Mean of the normal stresses.
    pub hydrostatic_mpa: f64,
    /// Largest shear stress, half of `tresca_mpa`.
    pub shear_max_mpa: f64,
    /// Normal of a plane with the largest shear stress; the plane with normal `shear_direction` has it too.
    pub shear_plane_normal: [f64; 3],
    /// Direction of the largest shear stress in that plane.
    pub shear_direction: [f64; 3],
}

/// Summary of the stresses below a patch. `/subsurface` returns the stresses at the requested points.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct SubsurfaceSummary {
    /// The body that the stresses belong to.
    pub body: BodyName,
    /// Smallest depth in mm at which stresses are evaluated; closer to the surface, mesh steps would distort them. Shallower points are
    /// evaluated at this depth.
    pub least_depth_mm: f64,
    /// The point with the largest von Mises stress; absent unless it was requested.
    pub worst: Option<StressPoint>,
    /// Criteria for a point of the body while the contact rolls over it; absent unless they were requested.
    pub passage: Option<PassageSummary>,
}

/// The worst places for the passage of the contact in steady rolling. A place is a line along x; its stresses cover its whole stress
/// history.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct PassageSummary {
    /// Where Dang Van's stress is largest; absent without a slope.
    pub dang_van: Option<PassagePlace>,
    /// Smallest yield stress in shear (von Mises) at which nothing yields even without residual stress.
    pub yield_without_residual: PassagePlace,
    /// Smallest yield stress in shear (von Mises) at which residual stresses can end yielding: the limit of elastic shakedown.
    pub yield_with_residual: PassagePlace,
}

/// A stress and the line along x that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct PassagePlace {
    /// Position `[y, depth]` of the line in mm.
    pub at_mm: [f64; 2],
    /// The stress.
    pub stress_mpa: f64,
}

/// Summary of the temperatures in the contact, which are the same on both surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Finite)]
pub struct TemperatureSummary {
    /// Highest temperature in °C.
    pub max_c: f64,
    /// Largest temperature rise by friction in K.
    pub rise_max_k: f64,
    /// Position of the highest temperature, `[x, y]` in mm.
    pub at_mm: [f64; 2],
    /// Temperature in the contact without friction, in °C; it lies between those of the bodies.
    pub without_friction_c: f64,
    /// Share of the friction heat that flows into the lower body.
    pub heat_share_lower: f64,
    /// Smaller of the two bodies' Péclet numbers. The theory assumes that heat flows only in the direction of depth, which holds for large
    /// values.
    pub peclet: f64,
}
