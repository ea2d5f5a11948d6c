//! The request of an evolution: the bodies that wear, the wear model, the extent, events and limits.

use railhead_macros::{Members, Words, keyword, none_is_absent};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::cross_section::CrossSection;
use crate::case::words::object::{AllowedRange, Faults, Member, Object, shown};
use crate::case::words::subsurface::DamageModel;
use crate::error::CaseError;
use crate::numerics::quadrature::PRIMES;

/// Profiles that wear under a traffic.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_extent)]
#[schema(as = EvolutionRequest)]
pub struct EvolutionWords {
    /// A case with one motion and a contact of type `profiles`. Members that a column replaces may be omitted; `outputs` is not needed. The
    /// default of `solver` is a target of 0.02.
    #[schema(value_type = Object)]
    #[member(with = template)]
    pub template: Value,
    /// The states of the traffic.
    #[member(with = traffic)]
    pub traffic: Traffic,
    /// Which bodies wear; default `both`.
    #[member(default)]
    pub wearing: WearingBodies,
    /// Wear law: `usfd_wear` (default) or `archard_wear`, with the parameters in `damage.parameters` of the template.
    #[member(with = wear_model, default = DamageModel::UsfdWear)]
    pub wear_model: DamageModel,
    /// Traffic over the rail and distance of the wheel.
    pub extent: EvolutionExtent,
    /// Number of stored steps after the start, equally spaced over the extent; default 10.
    #[schema(minimum = 1, maximum = 500)]
    #[member(1..=500, default = 10)]
    pub records: u32,
    /// Tolerances of the condensed traffic and of the steps.
    #[member(empty)]
    pub accuracy: EvolutionAccuracy,
    /// Losses for which the result reports when they are reached.
    #[member(default)]
    pub limits: WearLosses,
    /// Maintenance, in any order.
    #[member(with = events, 0..=100, default)]
    pub events: Vec<EvolutionEvent>,
    /// Uncertainty of a wear coefficient whose scatter is not published: with 90 % probability it lies between its value divided and
    /// multiplied by this factor; default 2.
    #[schema(minimum = 1.0)]
    #[member(closed(1.0, 100.0, ""), default = 2.0)]
    pub coefficient_factor: f64,
}

/// States of a traffic: a table, distributions that the service samples, or both.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Traffic {
    /// Columns named as those of a run: a number for each row, or a distribution that is sampled once for each row, independently of
    /// others.
    #[schema(value_type = BTreeMap<String, TrafficColumn>)]
    pub columns: Vec<(String, TrafficColumn)>,
    /// Relative number of passes of each row; default 1.
    #[schema(required = false)]
    pub passes: Vec<f64>,
    /// Number of rows of a traffic whose columns are all distributions; default 4096.
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

/// Distribution of a column: normal between two values if a mean and a standard deviation are given, otherwise uniform.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct TrafficDistribution {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean before truncation.
    pub mean: Option<f64>,
    /// Standard deviation before truncation.
    #[schema(exclusive_minimum = 0.0)]
    pub standard_deviation: Option<f64>,
}

/// The bodies that wear.
#[keyword(Default, Words)]
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
    /// Returns the extent in the unit in which events are given.
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
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema, Members)]
pub struct EvolutionExtent {
    /// Traffic over the rail in million gross tonnes; a row of the traffic counts twice its wheel load.
    #[member(positive(1e12, ""))]
    pub mgt: Option<f64>,
    /// Traffic over the rail as a number of axles, in place of `mgt`.
    #[member(positive(1e12, ""))]
    pub axle_passes: Option<f64>,
    /// Distance in km that the wheel rolls under this traffic; required if the wheel wears.
    #[member(positive(1e12, ""))]
    pub wheel_distance_km: Option<f64>,
}

/// Tolerances of an evolution.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema, Members)]
pub struct EvolutionAccuracy {
    /// Largest number of representative states; default 100.
    #[schema(minimum = 1, maximum = 2000)]
    #[member(1..=2000, default = 100)]
    pub states_max: u32,
    /// Error of the representative states, relative to the worn area, below which no more are added; default 0.03.
    #[member(positive(1.0, ""), default = 0.03)]
    pub states_tolerance: f64,
    /// Largest change of the wear distribution over a step, relative to the worn area; default 0.1.
    #[member(positive(1.0, ""), default = 0.1)]
    pub step_tolerance: f64,
    /// Largest depth that one step removes, in mm; default 0.03.
    #[member(positive(1.0, "mm"), default = 0.03)]
    pub step_depth_mm: f64,
    /// Number of steps after which the evolution ends; default 1000.
    #[schema(minimum = 1)]
    #[member(1..=100_000, default = 1000)]
    pub steps_max: u32,
    /// Standard deviation in mm of the kernel that smooths the wear of a step along the section; default 0.5.
    #[schema(minimum = 0.0)]
    #[member(closed(0.0, 5.0, "mm"), default = 0.5)]
    pub smoothing_mm: f64,
}

/// Losses of the sections in mm, or limits of these losses. A loss is absent if the section has no such place; a limit is absent if none is
/// wanted.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, ToSchema, Members)]
pub struct WearLosses {
    /// W1: height of the rail at y = 0.
    #[member(with = loss)]
    pub height_mm: Option<f64>,
    /// W2: gauge face of the rail, 14 mm below its top at the start.
    #[member(with = loss)]
    pub gauge_face_mm: Option<f64>,
    /// W3: gauge corner of the rail, at 45°.
    #[member(with = loss)]
    pub gauge_corner_mm: Option<f64>,
    /// Tread of the wheel at y = 0.
    #[member(with = loss)]
    pub tread_mm: Option<f64>,
    /// Flange of the wheel, 10 mm below its tread at the start.
    #[member(with = loss)]
    pub flange_mm: Option<f64>,
}

impl WearLosses {
    /// Returns names and values, first those of the rail.
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

/// A maintenance event.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_event)]
pub struct EvolutionEvent {
    /// Time of the event in the unit of the extent: `mgt` or `axle_passes`, or km if only the wheel wears.
    #[schema(minimum = 0.0)]
    #[member(closed(0.0, 1e12, ""))]
    pub at: f64,
    /// Grinds the rail to this section, lowered until it lies nowhere above the current one.
    pub grind: Option<Box<CrossSection>>,
    /// Turns the wheel to this section, moved toward the axle until it lies nowhere outside the current one.
    pub reprofile: Option<Box<CrossSection>>,
    /// Additional depth in mm that grinding or turning removes; default 0.
    #[schema(minimum = 0.0)]
    #[member(closed(0.0, 20.0, "mm"), default)]
    pub depth_mm: f64,
    /// Coefficient of friction of all states from this time on, for example after a lubricator is installed.
    #[schema(minimum = 0.0)]
    #[member(closed(0.0, 2.0, ""))]
    pub friction_coefficient: Option<f64>,
}

const MODELS: [(&str, DamageModel); 2] = [
    ("usfd_wear", DamageModel::UsfdWear),
    ("archard_wear", DamageModel::ArchardWear),
];
const AMOUNT: AllowedRange = AllowedRange::positive(1e12, "");
const NOT_NEGATIVE: AllowedRange = AllowedRange::closed(0.0, 1e12, "");
const ANY: AllowedRange = AllowedRange::closed(-1e12, 1e12, "");
const LOSS: AllowedRange = AllowedRange::positive(100.0, "mm");
/// Maximum number of rows of a traffic.
const ROWS_MAX: u32 = 200_000;
/// Default number of samples of a traffic whose columns are all distributions.
const SAMPLES_DEFAULT: u32 = 4096;

impl EvolutionWords {
    /// Reads an evolution. The names of its columns are JSON pointers into the template.
    ///
    /// # Errors
    /// All faults of the request, with their JSON pointers.
    pub(crate) fn read(value: &Value) -> Result<EvolutionWords, CaseError> {
        let mut faults = Faults::default();
        let words = Object::open(value, String::new(), &mut faults)
            .and_then(|mut all| EvolutionWords::members(&mut all));
        let faults = faults.into_list();
        words.filter(|_| faults.is_empty()).ok_or(CaseError(faults))
    }
}

/// Reads the template.
pub(crate) fn template(all: &mut Object, name: &str) -> Option<Value> {
    all.required(name, "a case of one motion").cloned()
}

/// Reads a wear model.
pub(crate) fn wear_model(all: &mut Object, name: &str) -> Option<DamageModel> {
    all.word(name, &MODELS)
}

/// Reads a limit of a loss.
pub(crate) fn loss(limits: &mut Object, name: &str) -> Option<f64> {
    limits.number(name, LOSS)
}

/// Refuses an extent that does not state how far each wearing body goes, or states the traffic twice.
pub(crate) fn faults_of_extent(all: &mut Object, _: Option<&EvolutionWords>) -> Option<()> {
    if !all.value("extent")?.is_object() {
        return None;
    }
    let wears = |body| {
        all.value("wearing")
            .is_none_or(|word| word == body || word == "both")
    };
    let [rail, wheel] = ["rail", "wheel"].map(wears);
    let mut block = all.child("extent")?;
    if block.has("mgt") && block.has("axle_passes") {
        block.fault("axle_passes", "given together with mgt; give one of them");
    } else if rail && !block.has("axle_passes") {
        let what = "mgt or axle_passes, how much traffic passes over the rail";
        block.required("mgt", what);
    }
    if wheel {
        block.required("wheel_distance_km", "the distance that the wheel rolls");
    }
    Some(())
}

/// Reads the events.
pub(crate) fn events(
    all: &mut Object,
    name: &str,
    least: usize,
    most: usize,
) -> Option<Vec<EvolutionEvent>> {
    let what = format!("an array of at most {most} events");
    all.each(name, least..=most, &what, EvolutionEvent::read)
}

/// Refuses an event without effect.
pub(crate) fn faults_of_event(block: &mut Object, _: Option<&EvolutionEvent>) -> Option<()> {
    let kinds = ["grind", "reprofile", "friction_coefficient"];
    if block.given(&kinds).is_empty() {
        let kinds = kinds.join(", ");
        return block.refuse_object(format!("the event has no effect; give one of {kinds}"));
    }
    Some(())
}

/// Reads the states of the traffic.
pub(crate) fn traffic(all: &mut Object, name: &str) -> Option<Traffic> {
    let mut block = all.child(name)?;
    block.only(&["columns", "passes", "samples"]);
    let samples = block.optional("samples", |block, name| {
        block.required_count(name, 1, ROWS_MAX)
    })?;
    let value = block.required("columns", "an object of columns")?;
    let members = value.as_object().filter(|members| !members.is_empty());
    let Some(members) = members else {
        let given = shown(value);
        let detail = format!("{given} given; an object with at least one column is needed");
        return block.refuse("columns", detail);
    };
    let first = members.values().find_map(Value::as_array);
    let rows = samples.or(first.map(|first| first.len() as u32));
    let samples = rows.unwrap_or(SAMPLES_DEFAULT);
    if !(1..=ROWS_MAX).contains(&samples) {
        let detail = format!("{samples} rows given; 1 to {ROWS_MAX} are allowed");
        return block.refuse("columns", detail);
    }
    let mut block_of_columns = block.child("columns")?;
    let column = |(name, value): (&String, &Value)| {
        let column = match value {
            Value::Object(_) => {
                distribution(block_of_columns.child(name)?).map(TrafficColumn::Distribution)
            }
            _ => numbers(&mut block_of_columns, name, ANY, samples).map(TrafficColumn::Numbers),
        };
        Some((name.clone(), column?))
    };
    let columns = members.iter().filter_map(column).collect();
    let given = members.values().filter(|of| of.is_object()).count();
    if given > PRIMES.len() {
        let most = PRIMES.len();
        let detail = format!("{given} distributions given; at most {most} are allowed");
        block.fault("columns", detail);
    }
    let passes = match block.has("passes") {
        true => numbers(&mut block, "passes", NOT_NEGATIVE, samples)?,
        false => vec![1.0; samples as usize],
    };
    if passes.iter().sum::<f64>() <= 0.0 {
        block.fault("passes", "all are 0; at least one more than 0 is needed");
    }
    Some(Traffic {
        columns,
        passes,
        samples,
    })
}

fn distribution(mut block: Object) -> Option<TrafficDistribution> {
    block.only(&["min", "max", "mean", "standard_deviation"]);
    let min = block.required_number("min", ANY);
    let max = block.required_number("max", AllowedRange::closed(min.unwrap_or(-1e12), 1e12, ""));
    let (min, max) = (min?, max?);
    let (mut mean, mut standard_deviation) = (None, None);
    if block.has("mean") || block.has("standard_deviation") {
        mean = block.required_number("mean", AllowedRange::closed(min, max, ""));
        standard_deviation = block.required_number("standard_deviation", AMOUNT);
    }
    Some(TrafficDistribution {
        min,
        max,
        mean,
        standard_deviation,
    })
}

/// Reads one number for each row.
fn numbers(block: &mut Object, name: &str, allowed: AllowedRange, rows: u32) -> Option<Vec<f64>> {
    let (rows, what) = (rows as usize, format!("one number for each of {rows} rows"));
    block.array(name, rows..=rows, &what)?;
    block.numbers(name, allowed)
}
