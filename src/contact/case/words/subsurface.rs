//! The members `subsurface` and `damage` of a case.

use railhead_macros::{Finite, Members, Words, keyword, none_is_absent};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::motion::POINTS_MAX;
use crate::case::words::object::{AllowedRange, Member, Object, shown};
use crate::case::words::samples::COORDINATE;

/// Points for stresses below the surface, in the axes of the patch: x along rolling, y to the left, depth positive into the body. At most
/// one of `points_mm`, `along_depth_at_mm` and `plane`; without them only the worst point is found.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[members(faults_of_places)]
pub struct Subsurface {
    /// Points `[x, y, depth]` in mm.
    #[member(with = points)]
    pub points_mm: Option<Vec<[f64; 3]>>,
    /// The vertical line below `[x, y]` in mm, or below the `"worst"` point of the patch; requires `depths_mm`.
    #[member(with = line_at)]
    pub along_depth_at_mm: Option<DepthLineAt>,
    /// Depths on that line in mm.
    #[member(with = list, closed(0.0, 1e6, "mm"))]
    pub depths_mm: Option<Vec<f64>>,
    /// A grid of points, usually in a plane.
    pub plane: Option<StressGrid>,
    /// The body; default `lower`.
    #[member(default)]
    pub body: BodyName,
    /// Find the point of every patch with the largest von Mises stress; default `true`.
    #[member(default = true)]
    pub worst: bool,
    /// Evaluate Dang Van's criterion and shakedown for a point of the body while the contact rolls over it.
    pub passage: Option<PassageWords>,
}

/// Criteria to evaluate for the passage of the contact in steady rolling: always shakedown, and Dang Van's criterion if its slope is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema, Members)]
#[schema(as = Passage)]
pub struct PassageWords {
    /// Weight of the hydrostatic stress in Dang Van's criterion, a property of the steel; without it the criterion is not evaluated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, minimum = 0, maximum = 10)]
    #[member(closed(0.0, 10.0, ""))]
    pub dang_van_slope: Option<f64>,
}

/// The surface point below which depths are measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum DepthLineAt {
    /// At `[x, y]` in mm.
    Place([f64; 2]),
    /// A point that the service finds.
    Found(FoundPlace),
}

/// A point that is found.
#[keyword]
pub enum FoundPlace {
    /// Where von Mises' stress is largest.
    Worst,
}

/// The product of three axes: x varies fastest, then y, then depth. For a plane, one axis is a single number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
pub struct StressGrid {
    /// x in mm.
    #[member(with = coordinates, closed(-1e6, 1e6, "mm"))]
    pub x_mm: GridAxis,
    /// y in mm.
    #[member(with = coordinates, closed(-1e6, 1e6, "mm"))]
    pub y_mm: GridAxis,
    /// Depths in mm.
    #[member(with = coordinates, closed(0.0, 1e6, "mm"))]
    pub depths_mm: GridAxis,
}

/// Coordinates along one axis: a number, a list, or equally spaced ones `{ "from", "to", "points" }`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum GridAxis {
    /// One coordinate.
    One(f64),
    /// A list of coordinates.
    List(Vec<f64>),
    /// Equally spaced coordinates, both ends included.
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
#[keyword(Default, Words, Finite)]
#[schema(as = Body)]
pub enum BodyName {
    /// Body 2, the rail.
    #[default]
    Lower,
    /// Body 1, the wheel.
    Upper,
}

/// Damage models to evaluate, and their parameters.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema, Members)]
#[schema(as = Damage)]
pub struct DamageWords {
    /// Models to evaluate. Default: `t_gamma` and `usfd_wear`, the models with confirmed parameters.
    #[member(with = models, default = MODELS_USUAL.to_vec())]
    pub models: Vec<DamageModel>,
    /// Name of a parameter set, or parameters that replace some of the default set's.
    #[member(with = parameters)]
    pub parameters: Option<DamageParameterWords>,
    /// Also compute wear strip by strip across the patch, from the power of every cell; default `false`.
    #[member(default)]
    pub across: bool,
}

/// A damage model.
#[keyword(PartialOrd, Ord, Words, Finite)]
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
    /// Position on the shakedown map.
    Shakedown,
}

/// Name of a parameter set, or parameters of the client.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum DamageParameterWords {
    /// A named set: `900a-r8t-1`.
    Named(DamageSetName),
    /// Parameters that replace those of the default set.
    Own(Box<OwnDamageFigures>),
}

/// Named parameter sets; a set that is changed gets another name.
#[keyword(Default, Words, Finite)]
pub enum DamageSetName {
    /// Rail UIC 900A, wheel R8T.
    #[default]
    #[serde(rename = "900a-r8t-1")]
    Rail900aWheelR8t,
}

/// Parameters of the client; the default set supplies those omitted.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, ToSchema, Members)]
pub struct OwnDamageFigures {
    /// Density of the worn material in kg/m³.
    #[member(positive(1e5, "kg/m³"))]
    pub density_kg_per_m3: Option<f64>,
    /// Yield stress in shear in MPa, for the surface fatigue index and the shakedown map.
    #[member(positive(1e6, "MPa"))]
    pub shear_yield_mpa: Option<f64>,
    /// Hardness of the worn material in MPa, for Archard's law.
    #[member(positive(1e6, "MPa"))]
    pub hardness_mpa: Option<f64>,
    /// The wear map of the University of Sheffield.
    pub usfd: Option<UsfdFigures>,
    /// The map of Archard's coefficients.
    pub archard: Option<ArchardFigures>,
    /// The damage function of the Whole Life Rail Model.
    pub wlrm: Option<WlrmFigures>,
}

/// Wear rate over power per area x in N/mm²: proportional to x, then constant, then rising again, without jumps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Members, Finite)]
#[members(faults_of_usfd)]
pub struct UsfdFigures {
    /// Rate over x where wear is mild, in µg/(m mm²) per N/mm².
    #[member(positive(1e12, ""))]
    pub mild_slope: f64,
    /// Wear is mild up to this x in N/mm².
    #[member(positive(1e12, ""))]
    pub mild_until: f64,
    /// Wear is severe, at the rate reached at `mild_until`, up to this x in N/mm².
    #[member(positive(1e12, ""))]
    pub severe_until: f64,
    /// Slope of the rate above `severe_until`.
    #[member(positive(1e12, ""))]
    pub catastrophic_slope: f64,
}

/// Archard's wear coefficients, each as the range `[low, high]` of the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Members, Finite)]
pub struct ArchardFigures {
    /// Mild wear: below the first and above the second sliding speed.
    #[member(with = pair)]
    pub mild: [f64; 2],
    /// Severe wear: between the two sliding speeds.
    #[member(with = pair)]
    pub severe: [f64; 2],
    /// Seizure: where the pressure exceeds its limit.
    #[member(with = pair)]
    pub seizure: [f64; 2],
    /// The two sliding speeds in mm/s.
    #[member(with = pair)]
    pub speeds_mm_per_s: [f64; 2],
    /// Ratio of pressure to hardness above which seizure occurs.
    #[member(positive(1e12, ""))]
    pub seizure_pressure: f64,
}

/// Damage of one pass over Tγ without spin: 0 up to a threshold, then linear up to a peak, then linear down through 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Members, Finite)]
#[members(faults_of_wlrm)]
pub struct WlrmFigures {
    /// Tγ in N up to which there is no damage.
    #[member(positive(1e12, ""))]
    pub threshold_n: f64,
    /// Tγ in N of the peak.
    #[member(positive(1e12, ""))]
    pub peak_at_n: f64,
    /// Tγ in N above which wear outweighs fatigue.
    #[member(positive(1e12, ""))]
    pub zero_at_n: f64,
    /// Damage of one pass at the peak; 1 is a visible crack.
    #[member(positive(1e12, ""))]
    pub peak: f64,
}

/// The default models: those with confirmed parameters.
const MODELS_USUAL: [DamageModel; 2] = [DamageModel::TGamma, DamageModel::UsfdWear];
const FIGURE: AllowedRange = AllowedRange::positive(1e12, "");

/// Reads the member `damage` of a case, which belongs to the output `damage`. A method without fields does not give wear across the patch.
///
/// Returns `None` if a fault was recorded.
pub(crate) fn read_damage(
    case: &mut Object,
    wanted: bool,
    without_fields: bool,
) -> Option<Option<DamageWords>> {
    of_output(case, "damage", wanted, |block| {
        let read = DamageWords::members(block);
        if without_fields && block.value("across") == Some(&Value::Bool(true)) {
            let detail = "true given; the method has no values per cell that wear across the patch is made from";
            return block.refuse("across", detail);
        }
        read
    })
}

/// Reads damage models, sorted and without repetition.
pub(crate) fn models(block: &mut Object, name: &str) -> Option<Vec<DamageModel>> {
    block.words(name, DamageModel::WORDS, DamageModel::read)
}

/// Reads the name of a parameter set, or parameters of the client.
pub(crate) fn parameters(block: &mut Object, name: &str) -> Option<DamageParameterWords> {
    if matches!(block.value(name)?, Value::Object(_)) {
        let own = OwnDamageFigures::read(block, name)?;
        return Some(DamageParameterWords::Own(Box::new(own)));
    }
    DamageSetName::read(block, name).map(DamageParameterWords::Named)
}

/// Refuses a map whose severe wear ends before it begins.
pub(crate) fn faults_of_usfd(block: &mut Object, read: Option<&UsfdFigures>) -> Option<()> {
    let read = read?;
    in_order(block, "severe_until", [read.mild_until, read.severe_until])
}

/// Refuses a damage function whose threshold, peak and zero are out of order.
pub(crate) fn faults_of_wlrm(block: &mut Object, read: Option<&WlrmFigures>) -> Option<()> {
    let read = read?;
    in_order(block, "peak_at_n", [read.threshold_n, read.peak_at_n])?;
    in_order(block, "zero_at_n", [read.peak_at_n, read.zero_at_n])
}

/// Reads `[low, high]`, both more than 0 and in order.
pub(crate) fn pair(block: &mut Object, name: &str) -> Option<[f64; 2]> {
    let value = block.required(name, "[low, high]")?;
    if value.as_array().is_none_or(|both| both.len() != 2) {
        return block.mistaken(name, "[low, high]");
    }
    let [low, high] = tuple(block, name, [FIGURE; 2])?;
    if low > high {
        let detail = format!("[{low}, {high}] given; the first may not be larger");
        return block.refuse(name, detail);
    }
    Some([low, high])
}

/// Reads numbers of an array, each in its own range; there are at least `N` elements.
fn tuple<const N: usize>(
    block: &mut Object,
    name: &str,
    allowed: [AllowedRange; N],
) -> Option<[f64; N]> {
    let mut elements = block.elements(name)?;
    let read: [Option<f64>; N] =
        std::array::from_fn(|k| elements.number(&k.to_string(), allowed[k]));
    let all: Option<Vec<f64>> = read.into_iter().collect();
    all?.try_into().ok()
}

fn in_order(block: &mut Object, name: &str, [before, after]: [f64; 2]) -> Option<()> {
    if before < after {
        return Some(());
    }
    block.refuse(name, format!("{after} given; more than {before} is needed"))
}

const DEPTH: AllowedRange = AllowedRange::closed(0.0, 1e6, "mm");
const PLACES: [&str; 3] = ["points_mm", "along_depth_at_mm", "plane"];

/// Reads the member `subsurface` of a case, which belongs to the output `subsurface`.
///
/// Returns `None` if a fault was recorded.
pub(crate) fn read_subsurface(case: &mut Object, wanted: bool) -> Option<Option<Subsurface>> {
    of_output(case, "subsurface", wanted, Subsurface::members)
}

/// Reads the member that belongs to the output of its name. An absent one is read as an empty object if the output is wanted.
fn of_output<T>(
    case: &mut Object,
    name: &str,
    wanted: bool,
    read: impl FnOnce(&mut Object) -> Option<T>,
) -> Option<Option<T>> {
    if !wanted && !case.has(name) {
        return Some(None);
    }
    if !wanted {
        let detail =
            format!("given without \"{name}\" among the outputs; add it there or leave this out");
        return case.refuse(name, detail);
    }
    read(&mut case.child_or_empty(name)?).map(Some)
}

/// Refuses more than one kind of places, and a line without depths.
pub(crate) fn faults_of_places(block: &mut Object, _: Option<&Subsurface>) -> Option<()> {
    if let [first, second, ..] = block.given(&PLACES)[..] {
        let detail = format!("given together with {first}; at most one of the two is allowed");
        return block.refuse(second, detail);
    }
    match (block.has("along_depth_at_mm"), block.has("depths_mm")) {
        (true, false) => block
            .required("depths_mm", "an array of depths in mm")
            .map(|_| ()),
        (false, true) => {
            let detail = "given without along_depth_at_mm; the depths belong to its line";
            block.refuse("depths_mm", detail)
        }
        _ => Some(()),
    }
}

/// Reads points `[x, y, depth]`.
pub(crate) fn points(block: &mut Object, name: &str) -> Option<Vec<[f64; 3]>> {
    let what = "an array of points [x, y, depth] in mm";
    block.each(name, 1..=usize::MAX, what, |points, index| {
        let element = points.value(index)?;
        if element.as_array().is_none_or(|point| point.len() != 3) {
            let given = shown(element);
            let detail = format!("{given} given; three numbers [x, y, depth] in mm are needed");
            let pointer = points.pointer_to(index);
            return points.faults().refuse(pointer, detail);
        }
        tuple(points, index, [COORDINATE, COORDINATE, DEPTH])
    })
}

/// Reads a point `[x, y]` of the surface or the keyword `worst`.
pub(crate) fn line_at(block: &mut Object, name: &str) -> Option<DepthLineAt> {
    let value = block.value(name)?;
    if value.as_str() == Some("worst") {
        return Some(DepthLineAt::Found(FoundPlace::Worst));
    }
    if value.as_array().is_some_and(|place| place.len() == 2) {
        return tuple(block, name, [COORDINATE; 2]).map(DepthLineAt::Place);
    }
    block.mistaken(name, "[x, y] in mm or \"worst\"")
}

/// Reads a list of numbers in mm.
pub(crate) fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Vec<f64>> {
    let what = "an array of numbers in mm";
    block.number_array(name, 1..=usize::MAX, what, allowed)
}

/// Reads the coordinates of a grid along one axis.
pub(crate) fn coordinates(
    block: &mut Object,
    name: &str,
    allowed: AllowedRange,
) -> Option<GridAxis> {
    let what = "a number, an array of numbers or {\"from\", \"to\", \"points\"}";
    match block.required(name, what)? {
        Value::Array(_) => list(block, name, allowed).map(GridAxis::List),
        Value::Object(_) => {
            let (from, to, points) = block.child(name)?.range(allowed, 2, POINTS_MAX)?;
            Some(GridAxis::Spaced { from, to, points })
        }
        _ => block.number(name, allowed).map(GridAxis::One),
    }
}
