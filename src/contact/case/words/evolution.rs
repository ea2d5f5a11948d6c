//! Request of an evolution: the bodies that wear, the wear model, the extent, events and limits.

use railhead_macros::none_is_absent;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::contact::case::words::contact::CrossSection;
use crate::contact::case::words::subsurface::DamageModel;

/// Profiles that wear under a traffic.
#[derive(Debug, Clone, PartialEq, ToSchema)]
#[schema(as = EvolutionRequest)]
pub struct EvolutionWords {
    /// A case of one motion whose contact is of the type `profiles`. Members that a column holds may be left out; `outputs` is not needed, and
    /// `solver` has a target of 0.02 when left out.
    #[schema(value_type = Object)]
    pub template: Value,
    /// The states of the traffic.
    pub traffic: Traffic,
    /// Which bodies wear; `both` when left out.
    #[schema(required = false)]
    pub wearing: WearingBodies,
    /// Law of wear: `usfd_wear` (when left out) or `archard_wear`. Its figures are those of `damage.parameters` in the template.
    #[schema(required = false)]
    pub wear_model: DamageModel,
    /// Traffic over the rail and distance of the wheel.
    pub extent: EvolutionExtent,
    /// Stored steps after the start, equally spaced over the extent; 10 when left out.
    #[schema(required = false, minimum = 1, maximum = 500)]
    pub records: u32,
    /// Tolerances of the condensed traffic and of the steps.
    #[schema(required = false)]
    pub accuracy: EvolutionAccuracy,
    /// Losses for which the time is reported.
    #[schema(required = false)]
    pub limits: WearLosses,
    /// Maintenance, in any order.
    #[schema(required = false)]
    pub events: Vec<EvolutionEvent>,
    /// Uncertainty of a wear coefficient whose scatter is not published: it lies between the value divided and multiplied by this with a
    /// probability of 90 %; 2 when left out.
    #[schema(required = false, minimum = 1.0)]
    pub coefficient_factor: f64,
}

/// States of a traffic: a table, distributions that the service samples, or both.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Traffic {
    /// Columns named as those of a run: a number for each row, or a distribution that is sampled once for each row. Distributions are independent of
    /// each other.
    #[schema(value_type = BTreeMap<String, TrafficColumn>)]
    pub columns: Vec<(String, TrafficColumn)>,
    /// Relative numbers of passes of the rows; 1 for each when left out.
    #[schema(required = false)]
    pub passes: Vec<f64>,
    /// Rows of a traffic whose columns are all distributions; 4096 when left out.
    #[schema(required = false, minimum = 1, maximum = 200_000)]
    pub samples: u32,
}

/// A column of a traffic.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum TrafficColumn {
    /// The values of the rows.
    Numbers(Vec<f64>),
    /// A distribution.
    Distribution(TrafficDistribution),
}

/// Distribution of a column: normal between two values if it has a mean and a standard deviation, else uniform.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct TrafficDistribution {
    /// Least value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean before the ends are cut off.
    #[schema(nullable = false)]
    pub mean: Option<f64>,
    /// Standard deviation before the ends are cut off.
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub standard_deviation: Option<f64>,
}

/// The bodies that wear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum WearingBodies {
    /// The rail.
    Rail,
    /// The wheel.
    Wheel,
    /// Both.
    #[default]
    Both,
}

impl EvolutionWords {
    /// The extent in the unit that events are given in.
    pub(crate) fn end(&self) -> f64 {
        let extent = &self.extent;
        let rail = extent.mgt.or(extent.axle_passes);
        rail.or(extent.wheel_distance_km).unwrap_or(0.0)
    }
}

impl WearingBodies {
    /// Whether the rail and the wheel wear.
    pub(crate) fn flags(self) -> [bool; 2] {
        [self != WearingBodies::Wheel, self != WearingBodies::Rail]
    }
}

/// Extent of an evolution. Rail and wheel advance in proportion.
#[derive(Debug, Clone, Copy, PartialEq, ToSchema)]
pub struct EvolutionExtent {
    /// Traffic over the rail in million gross tonnes; a row of the traffic counts twice its wheel load.
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub mgt: Option<f64>,
    /// Traffic over the rail as a number of axles, in place of `mgt`.
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub axle_passes: Option<f64>,
    /// Distance that the wheel rolls under this traffic in km; needed where the wheel wears.
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub wheel_distance_km: Option<f64>,
}

/// Tolerances of an evolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct EvolutionAccuracy {
    /// Largest number of representative states; 100 when left out.
    #[schema(required = false, minimum = 1, maximum = 2000)]
    pub states_max: u32,
    /// Error of the representative states relative to the worn area, at which no more are added; 0.03 when left out.
    #[schema(required = false, exclusive_minimum = 0.0)]
    pub states_tolerance: f64,
    /// Change of the distribution of wear over a step, relative to the worn area; 0.1 when left out.
    #[schema(required = false, exclusive_minimum = 0.0)]
    pub step_tolerance: f64,
    /// Largest depth that one step removes, in mm; 0.03 when left out.
    #[schema(required = false, exclusive_minimum = 0.0)]
    pub step_depth_mm: f64,
    /// Most steps; 1000 when left out.
    #[schema(required = false, minimum = 1)]
    pub steps_max: u32,
    /// Standard deviation in mm of the kernel that smooths the wear of a step along the section; 0.5 when left out.
    #[schema(required = false, minimum = 0.0)]
    pub smoothing_mm: f64,
}

impl Default for EvolutionAccuracy {
    fn default() -> EvolutionAccuracy {
        EvolutionAccuracy {
            states_max: 100,
            states_tolerance: 0.03,
            step_tolerance: 0.1,
            step_depth_mm: 0.03,
            steps_max: 1000,
            smoothing_mm: 0.5,
        }
    }
}

/// Losses of the sections in mm, or limits of them; absent where a section has no such place, and where no limit is wanted.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema)]
pub struct WearLosses {
    /// W1: height of the rail at y = 0.
    pub height_mm: Option<f64>,
    /// W2: gauge face of the rail, 14 mm below its top at the start.
    pub gauge_face_mm: Option<f64>,
    /// W3: gauge corner of the rail, at 45°.
    pub gauge_corner_mm: Option<f64>,
    /// Tread of the wheel at y = 0.
    pub tread_mm: Option<f64>,
    /// Flange of the wheel, 10 mm below its tread at the start.
    pub flange_mm: Option<f64>,
}

impl WearLosses {
    /// Names and values, first those of the rail.
    #[must_use]
    pub fn named(&self) -> [(&'static str, Option<f64>); 5] {
        [
            ("height_mm", self.height_mm),
            ("gauge_face_mm", self.gauge_face_mm),
            ("gauge_corner_mm", self.gauge_corner_mm),
            ("tread_mm", self.tread_mm),
            ("flange_mm", self.flange_mm),
        ]
    }
}

/// Maintenance at one time.
#[derive(Debug, Clone, PartialEq, ToSchema)]
pub struct EvolutionEvent {
    /// Time of the event, in the unit of the extent: `mgt` or `axle_passes`, and km where only the wheel wears.
    #[schema(minimum = 0.0)]
    pub at: f64,
    /// Grinds the rail to this section, lowered until it lies nowhere above the present one.
    #[schema(nullable = false, inline = false)]
    pub grind: Option<Box<CrossSection>>,
    /// Turns the wheel to this section, moved toward the axle until it lies nowhere outside the present one.
    #[schema(nullable = false, inline = false)]
    pub reprofile: Option<Box<CrossSection>>,
    /// Depth in mm by which grinding or turning goes beyond that; 0 when left out.
    #[schema(required = false, minimum = 0.0)]
    pub depth_mm: f64,
    /// Coefficient of friction of all states from then on, as of a lubricator.
    #[schema(nullable = false, minimum = 0.0)]
    pub friction_coefficient: Option<f64>,
}
