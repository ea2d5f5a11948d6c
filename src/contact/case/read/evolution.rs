//! Reads what is asked of an evolution: its plan, and its traffic as columns of numbers.

use serde_json::{Map, Value};

use crate::contact::case::read::faults::{AllowedRange, Faults};
use crate::contact::case::read::object::{Object, join, number, shown};
use crate::contact::case::read::wheel_rail::section;
use crate::contact::case::words::damage::DamageModel;
use crate::contact::case::words::evolution::{
    EvolutionAccuracy, EvolutionEvent, EvolutionExtent, EvolutionWords, WearLimits, WearingBodies,
};
use crate::contact::error::{CaseError, Fault};
use crate::contact::numerics::sampling::{PRIMES, halton, normal_probability, normal_quantile};

const BODIES: [(&str, WearingBodies); 3] = [
    ("rail", WearingBodies::Rail),
    ("wheel", WearingBodies::Wheel),
    ("both", WearingBodies::Both),
];
const MODELS: [(&str, DamageModel); 2] = [
    ("usfd_wear", DamageModel::UsfdWear),
    ("archard_wear", DamageModel::ArchardWear),
];
const MEMBERS: [&str; 10] = [
    "template",
    "traffic",
    "wearing",
    "wear_model",
    "extent",
    "records",
    "accuracy",
    "limits",
    "events",
    "coefficient_factor",
];
const AMOUNT: AllowedRange = AllowedRange::positive(1e12, "");
const LOSS: AllowedRange = AllowedRange::positive(100.0, "mm");
const SHARE: AllowedRange = AllowedRange::positive(1.0, "");
/// Events of one evolution.
const EVENTS_MAX: usize = 100;
/// Rows of a traffic.
pub const ROWS_MAX: usize = 200_000;
/// Samples of a traffic whose columns are distributions.
const SAMPLES_DEFAULT: u32 = 4096;

/// An evolution as it was sent, without faults of the text.
#[derive(Debug, Clone, PartialEq)]
pub struct EvolutionDraft {
    /// A case of one motion.
    pub template: Value,
    /// Places in the case and their values, one for each row.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Relative numbers of passes of the rows.
    pub passes: Vec<f64>,
    /// The plan.
    pub plan: EvolutionWords,
}

impl EvolutionDraft {
    /// Reads an evolution whose columns are named by JSON pointers into the template.
    ///
    /// # Errors
    /// Every fault of the text, with its JSON pointer.
    pub fn read(value: &Value) -> Result<EvolutionDraft, CaseError> {
        let mut faults = Faults::default();
        let draft =
            Object::open(value, String::new(), &mut faults).and_then(|mut all| draft(&mut all));
        let listed = faults.into_list();
        match draft {
            Some(draft) if listed.is_empty() => Ok(draft),
            _ if listed.is_empty() => Err(CaseError(vec![Fault::new("", "not an evolution")])),
            _ => Err(CaseError(listed)),
        }
    }
}

fn draft(all: &mut Object) -> Option<EvolutionDraft> {
    all.only(&MEMBERS, &[]);
    let template = all.required("template", "a case of one motion").cloned();
    let traffic = traffic(&mut all.child("traffic")?);
    let wearing = word_or(all, "wearing", &BODIES, WearingBodies::Both);
    let wear_model = word_or(all, "wear_model", &MODELS, DamageModel::UsfdWear);
    let extent = extent(&mut all.child("extent")?, wearing.unwrap_or_default());
    let records = match all.has("records") {
        true => all.required_count("records", 1, 500),
        false => Some(10),
    };
    let accuracy = match all.has("accuracy") {
        true => accuracy(&mut all.child("accuracy")?),
        false => Some(EvolutionAccuracy::default()),
    };
    let limits = match all.has("limits") {
        true => limits(&mut all.child("limits")?),
        false => Some(WearLimits::default()),
    };
    let events = events(all);
    let factor = AllowedRange::closed(1.0, 100.0, "");
    let coefficient_factor = number_or(all, "coefficient_factor", factor, 2.0);
    let (columns, passes) = traffic?;
    Some(EvolutionDraft {
        template: template?,
        columns,
        passes,
        plan: EvolutionWords {
            wearing: wearing?,
            wear_model: wear_model?,
            extent: extent?,
            records: records?,
            accuracy: accuracy?,
            limits: limits?,
            events: events?,
            coefficient_factor: coefficient_factor?,
        },
    })
}

fn word_or<T: Copy>(block: &mut Object, name: &str, table: &[(&str, T)], or: T) -> Option<T> {
    match block.has(name) {
        true => block.word(name, table, &[]),
        false => Some(or),
    }
}

fn number_or(block: &mut Object, name: &str, allowed: AllowedRange, or: f64) -> Option<f64> {
    match block.has(name) {
        true => block.number(name, allowed),
        false => Some(or),
    }
}

fn extent(block: &mut Object, wearing: WearingBodies) -> Option<EvolutionExtent> {
    block.only(&["mgt", "axle_passes", "wheel_distance_km"], &[]);
    let extent = EvolutionExtent {
        mgt: block.number("mgt", AMOUNT),
        axle_passes: block.number("axle_passes", AMOUNT),
        wheel_distance_km: block.number("wheel_distance_km", AMOUNT),
    };
    let [rail, wheel] = wearing.flags();
    if block.has("mgt") && block.has("axle_passes") {
        block.fault("axle_passes", "given together with mgt; give one of them");
    } else if rail && !block.has("mgt") && !block.has("axle_passes") {
        block.required(
            "mgt",
            "mgt or axle_passes, how much traffic passes over the rail",
        );
    }
    if wheel {
        block.required("wheel_distance_km", "the distance that the wheel rolls");
    }
    Some(extent)
}

fn accuracy(block: &mut Object) -> Option<EvolutionAccuracy> {
    let names = [
        "states_max",
        "states_tolerance",
        "step_tolerance",
        "step_depth_mm",
        "steps_max",
        "smoothing_mm",
    ];
    block.only(&names, &[]);
    let or = EvolutionAccuracy::default();
    let count_or = |block: &mut Object, name: &str, most: u32, or: u32| match block.has(name) {
        true => block.required_count(name, 1, most),
        false => Some(or),
    };
    let states_max = count_or(block, "states_max", 2000, or.states_max);
    let states_tolerance = number_or(block, "states_tolerance", SHARE, or.states_tolerance);
    let step_tolerance = number_or(block, "step_tolerance", SHARE, or.step_tolerance);
    let depth = AllowedRange::positive(1.0, "mm");
    let step_depth_mm = number_or(block, "step_depth_mm", depth, or.step_depth_mm);
    let steps_max = count_or(block, "steps_max", 100_000, or.steps_max);
    let kernel = AllowedRange::closed(0.0, 5.0, "mm");
    let smoothing_mm = number_or(block, "smoothing_mm", kernel, or.smoothing_mm);
    Some(EvolutionAccuracy {
        states_max: states_max?,
        states_tolerance: states_tolerance?,
        step_tolerance: step_tolerance?,
        step_depth_mm: step_depth_mm?,
        steps_max: steps_max?,
        smoothing_mm: smoothing_mm?,
    })
}

fn limits(block: &mut Object) -> Option<WearLimits> {
    let names = [
        "height_mm",
        "gauge_face_mm",
        "gauge_corner_mm",
        "tread_mm",
        "flange_mm",
    ];
    block.only(&names, &[]);
    let [
        height_mm,
        gauge_face_mm,
        gauge_corner_mm,
        tread_mm,
        flange_mm,
    ] = names.map(|name| block.number(name, LOSS));
    Some(WearLimits {
        height_mm,
        gauge_face_mm,
        gauge_corner_mm,
        tread_mm,
        flange_mm,
    })
}

fn events(all: &mut Object) -> Option<Vec<EvolutionEvent>> {
    let Some(value) = all.value("events") else {
        return Some(Vec::new());
    };
    let pointer = all.pointer_to("events");
    let Some(elements) = value.as_array().filter(|list| list.len() <= EVENTS_MAX) else {
        let detail = format!(
            "{} given; an array of at most {EVENTS_MAX} events is needed",
            shown(value)
        );
        all.fault("events", detail);
        return None;
    };
    let faults = all.faults();
    let read = elements.iter().enumerate().map(|(k, element)| {
        let mut block = Object::open(element, join(&pointer, k), faults)?;
        event(&mut block)
    });
    let read: Vec<Option<EvolutionEvent>> = read.collect();
    let mut events = read.into_iter().collect::<Option<Vec<EvolutionEvent>>>()?;
    events.sort_by(|a, b| a.at.total_cmp(&b.at));
    Some(events)
}

fn event(block: &mut Object) -> Option<EvolutionEvent> {
    let kinds = ["grind", "reprofile", "friction_coefficient"];
    block.only(&["at", kinds[0], kinds[1], kinds[2], "depth_mm"], &[]);
    let at = block.required_number("at", AllowedRange::closed(0.0, 1e12, ""));
    let grind = section_or(block, "grind");
    let reprofile = section_or(block, "reprofile");
    let depth_mm = number_or(
        block,
        "depth_mm",
        AllowedRange::closed(0.0, 20.0, "mm"),
        0.0,
    );
    let friction_coefficient =
        block.number("friction_coefficient", AllowedRange::closed(0.0, 2.0, ""));
    if kinds.iter().all(|kind| !block.has(kind)) {
        block.fault_here(format!("nothing happens; give one of {}", kinds.join(", ")));
    }
    Some(EvolutionEvent {
        at: at?,
        grind: grind?,
        reprofile: reprofile?,
        depth_mm: depth_mm?,
        friction_coefficient,
    })
}

fn section_or(
    block: &mut Object,
    name: &str,
) -> Option<Option<Box<crate::contact::case::words::contact::CrossSection>>> {
    match block.has(name) {
        true => section(block, name).map(|section| Some(Box::new(section))),
        false => Some(None),
    }
}

type Traffic = (Vec<(String, Vec<f64>)>, Vec<f64>);

fn traffic(block: &mut Object) -> Option<Traffic> {
    block.only(&["columns", "passes", "samples"], &[]);
    let value = block.required("columns", "an object of columns")?;
    let pointer = block.pointer_to("columns");
    let Value::Object(members) = value else {
        block.fault(
            "columns",
            format!("{} given; an object of columns is needed", shown(value)),
        );
        return None;
    };
    if members.values().any(Value::is_object) {
        return sampled_traffic(block, members, &pointer);
    }
    if block.has("samples") {
        block.fault(
            "samples",
            "given for columns of numbers; it belongs to distributions",
        );
    }
    let faults = block.faults();
    let any = AllowedRange::closed(-1e12, 1e12, "");
    let read = members.iter().map(|(name, values)| {
        let values = numbers(values, &join(&pointer, name), any, faults)?;
        Some((name.clone(), values))
    });
    let read: Vec<Option<(String, Vec<f64>)>> = read.collect();
    let columns = read.into_iter().collect::<Option<Vec<_>>>()?;
    let Some(rows) = columns.first().map(|(_, values)| values.len()) else {
        block.fault("columns", "no columns given; at least one is needed");
        return None;
    };
    for (name, values) in &columns {
        if values.len() != rows {
            let detail = format!(
                "{} values given, the first column has {rows}; all columns need as many",
                values.len()
            );
            block.faults().add(join(&pointer, name), detail);
        }
    }
    let Some(passes) = block.value("passes") else {
        return Some((columns, vec![1.0; rows]));
    };
    let pointer = block.pointer_to("passes");
    let weight = AllowedRange::closed(0.0, 1e12, "");
    let passes = numbers(passes, &pointer, weight, block.faults())?;
    if passes.len() != rows {
        let detail = format!(
            "{} values given; one for each of the {rows} rows is needed",
            passes.len()
        );
        block.fault("passes", detail);
    } else if passes.iter().sum::<f64>() <= 0.0 {
        block.fault("passes", "all are 0; at least one more than 0 is needed");
    }
    Some((columns, passes))
}

/// A traffic whose columns are distributions, at the points of Halton's sequence: one dimension for each column, all independent.
fn sampled_traffic(
    block: &mut Object,
    members: &Map<String, Value>,
    pointer: &str,
) -> Option<Traffic> {
    if block.has("passes") {
        block.fault(
            "passes",
            "given for distributions; it belongs to columns of numbers",
        );
    }
    let samples = match block.has("samples") {
        true => block.required_count("samples", 1, ROWS_MAX as u32),
        false => Some(SAMPLES_DEFAULT),
    };
    if members.len() > PRIMES.len() {
        let detail = format!(
            "{} distributions given; at most {} are allowed",
            members.len(),
            PRIMES.len()
        );
        block.fault("columns", detail);
        return None;
    }
    let faults = block.faults();
    let read = members.iter().map(|(name, value)| {
        let mut block = Object::open(value, join(pointer, name), faults)?;
        Some((name.clone(), distribution(&mut block)?))
    });
    let read: Vec<Option<(String, Distribution)>> = read.collect();
    let samples = samples?;
    let columns = read.into_iter().zip(PRIMES).map(|(read, base)| {
        let (name, distribution) = read?;
        let values = (1..=samples).map(|k| distribution.value_at(halton(k, base)));
        Some((name, values.collect()))
    });
    let columns = columns.collect::<Option<Vec<_>>>()?;
    Some((columns, vec![1.0; samples as usize]))
}

/// A distribution of a column between two values: uniform, or normal where it has a mean and a standard deviation.
struct Distribution {
    range: [f64; 2],
    normal: Option<[f64; 2]>,
}

impl Distribution {
    /// The value below which this share of the traffic lies.
    fn value_at(&self, share: f64) -> f64 {
        let [low, high] = self.range;
        let Some([mean, deviation]) = self.normal else {
            return low + share * (high - low);
        };
        let [from, to] = self
            .range
            .map(|end| normal_probability((end - mean) / deviation));
        (mean + deviation * normal_quantile(from + share * (to - from))).clamp(low, high)
    }
}

fn distribution(block: &mut Object) -> Option<Distribution> {
    block.only(&["min", "max", "mean", "standard_deviation"], &[]);
    let any = AllowedRange::closed(-1e12, 1e12, "");
    let low = block.required_number("min", any);
    let high = block.required_number("max", any);
    let is_normal = block.has("mean") || block.has("standard_deviation");
    let normal = match is_normal {
        true => {
            let mean = block.required_number("mean", any);
            let spread = AllowedRange::positive(1e12, "");
            let deviation = block.required_number("standard_deviation", spread);
            Some([mean?, deviation?])
        }
        false => None,
    };
    let range = [low?, high?];
    if range[0] > range[1] {
        block.fault(
            "max",
            format!("{} given; at least min, {}, is needed", range[1], range[0]),
        );
        return None;
    }
    if let Some([mean, _]) = normal
        && !(range[0]..=range[1]).contains(&mean)
    {
        block.fault(
            "mean",
            format!(
                "{mean} given; {} to {} is allowed, min to max",
                range[0], range[1]
            ),
        );
        return None;
    }
    Some(Distribution { range, normal })
}

fn numbers(
    value: &Value,
    pointer: &str,
    allowed: AllowedRange,
    faults: &mut Faults,
) -> Option<Vec<f64>> {
    let Some(elements) = value
        .as_array()
        .filter(|all| (1..=ROWS_MAX).contains(&all.len()))
    else {
        let detail = format!(
            "{} given; an array of 1 to {ROWS_MAX} numbers is needed",
            shown(value)
        );
        faults.add(pointer, detail);
        return None;
    };
    let one = |(k, element)| number(element, &join(pointer, k), allowed, faults);
    let read: Vec<Option<f64>> = elements.iter().enumerate().map(one).collect();
    read.into_iter().collect()
}
