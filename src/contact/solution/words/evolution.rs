//! The answer of an evolution, and the state between two of its steps.

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::contact::case::words::evolution::WearLosses;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::solution::words::damage::DamageFiguresUsed;

/// The answer of an evolution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvolutionAnswer {
    /// Profiles and contact at the start, at each stored step, and before and after each event.
    pub records: Vec<EvolutionRecord>,
    /// When each limit is reached, interpolated linearly between records.
    pub limits: Vec<LimitReached>,
    /// The representative states that stand for the traffic.
    pub traffic: CondensedTraffic,
    /// Accepted steps.
    pub steps: u32,
    /// Steps that were repeated with a shorter length.
    pub steps_rejected: u32,
    /// Contacts solved.
    pub solves: u32,
    /// The figures that wear and damage were computed with.
    pub damage_parameters: DamageFiguresUsed,
    /// Remarks that matter to the use of the numbers.
    pub remarks: Vec<RemarkEntry>,
}

/// Progress of an evolution.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = EvolutionProgress)]
pub struct Progress {
    /// Fraction of the extent that is done.
    pub share: f64,
    /// Traffic over the rail in million gross tonnes; absent where only the wheel wears.
    pub mgt: Option<f64>,
    /// Axles over the rail.
    pub axle_passes: Option<f64>,
    /// Distance of the wheel in km; absent where only the rail wears.
    pub wheel_distance_km: Option<f64>,
}

/// The profiles and their contact at one time.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EvolutionRecord {
    /// When.
    pub progress: Progress,
    /// Events that have happened.
    pub events_done: u32,
    /// The rail.
    pub rail: WornBody,
    /// The wheel.
    pub wheel: WornBody,
    /// Losses against the sections at the start.
    pub losses: WearLosses,
    /// Equivalent conicity (EN 15302) at 3 mm of a wheelset with this wheel on both sides of a track of this rail; absent where it has none.
    pub conicity: Option<f64>,
    /// The contact over all states.
    pub contact: ContactRange,
    /// The contact of each state.
    pub states: Vec<StateContact>,
}

/// A worn section. Arrays have one entry for each point.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct WornBody {
    /// Points `[y, z]` in mm, y to the field side and z down, as `points_mm` of a cross-section.
    pub points_mm: Vec<[f64; 2]>,
    /// Depth worn away along the normal in mm, without maintenance.
    pub depth_mm: Vec<f64>,
    /// Damage by the Whole Life Rail Model: 1 is a visible crack; not below 0, where wear outweighs fatigue.
    pub damage: Vec<f64>,
    /// Area of the section that wear has removed, in mm²; times the length, the volume.
    pub worn_area_mm2: f64,
    /// Area that grinding or turning has removed, in mm².
    pub machined_area_mm2: f64,
    /// Uncertainty of the worn area.
    pub uncertainty: WearUncertainty,
}

/// Uncertainties of worn areas and depths by their source, relative to the worn area.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct WearUncertainty {
    /// Of the step length, from halving each step.
    pub steps: f64,
    /// Of replacing the traffic by representative states, from halving each group of rows along each column.
    pub states: f64,
    /// Of the contact solutions, from the error estimates of their friction power.
    pub contact: f64,
    /// Of the wear coefficients: the factors on worn areas that bound 90 % of the sampled coefficients.
    pub coefficients: [f64; 2],
}

/// The contact over all states.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct ContactRange {
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Mean over the traffic of the largest pressure of each state.
    pub pressure_mean_mpa: f64,
    /// Largest Y/Q: lateral over vertical force of the wheel.
    pub y_over_q_max: f64,
    /// Mean over the traffic.
    pub y_over_q_mean: f64,
    /// Mean over the traffic of the friction power over the speed, in N.
    pub t_gamma_mean_n: f64,
    /// Share of the traffic whose contact could not be solved; it is taken to wear nothing.
    pub unsolved_share: f64,
}

/// The contact of one state.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct StateContact {
    /// Share of the traffic.
    pub share: f64,
    /// Y/Q.
    pub y_over_q: f64,
    /// Its patches; none where it was not solved.
    pub patches: Vec<StatePatch>,
    /// Why it was not solved.
    pub failure: Option<String>,
}

/// A patch of a state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StatePatch {
    /// Load centre on the rail's section, `[y, z]` in mm.
    pub rail_mm: [f64; 2],
    /// The same on the wheel's section.
    pub wheel_mm: [f64; 2],
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Largest pressure in MPa.
    pub pressure_max_mpa: f64,
    /// Friction power over the speed, in N.
    pub t_gamma_n: f64,
}

/// A traffic condensed to a few states.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct CondensedTraffic {
    /// Rows that were sent.
    pub rows: u32,
    /// Places in the case that the values belong to.
    pub pointers: Vec<String>,
    /// The states.
    pub states: Vec<TrafficState>,
    /// Change of the distribution of wear of rail and wheel when every group of rows is halved, relative to the worn area; after spreading.
    pub error: [f64; 2],
}

/// A representative state of the traffic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrafficState {
    /// Share of the traffic.
    pub share: f64,
    /// Number of rows that it represents.
    pub rows: u32,
    /// Their means, in the order of `pointers`.
    pub values: Vec<f64>,
    /// Standard deviation in mm by which the wear of the state is spread along rail and wheel, for the places at which its rows touch.
    pub spread_mm: [f64; 2],
}

/// When a limit is reached.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LimitReached {
    /// The loss, as `limits` names it.
    pub loss: String,
    /// The limit in mm.
    pub limit_mm: f64,
    /// When; absent where the extent ends before.
    pub reached: Option<Progress>,
    /// The earliest time within the uncertainty of the loss.
    pub earliest: Option<Progress>,
    /// The latest time within it; absent where the extent ends before.
    pub latest: Option<Progress>,
}

/// State of an evolution between two steps; the next step depends on nothing else. JSON keeps every bit of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct EvolutionState {
    /// Share of the extent that is done.
    pub share: f64,
    /// Share of the next step.
    pub next: f64,
    /// The present time has a record.
    pub recorded: bool,
    /// Events that have happened.
    pub events_done: u32,
    /// Coefficient of friction in place of that of the states.
    pub friction: Option<f64>,
    /// The states; none before the first step.
    pub traffic: CondensedTraffic,
    /// y on the wheel's section where each state touched last.
    pub wheel_y: Vec<f64>,
    /// Rail and wheel.
    pub bodies: [BodyState; 2],
    /// Accepted steps.
    pub steps: u32,
    /// Repeated steps.
    pub rejected: u32,
    /// Contacts solved.
    pub solves: u32,
}

/// A body between two steps.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BodyState {
    /// Points at the start, as `points_mm`.
    pub start_mm: Vec<[f64; 2]>,
    /// The body as the next record shows it.
    pub worn: WornBody,
    /// Worn area by regimes: mild, severe, and seizure or catastrophic.
    pub regimes_mm2: [f64; 3],
    /// Sum of the differences in depth between the midpoint rule and Euler's rule, at each point.
    pub step_change_mm: Vec<f64>,
    /// Area that the errors of the contact leave open.
    pub contact_mm2: f64,
}
