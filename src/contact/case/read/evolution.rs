//! Reads what is asked of an evolution: its plan, and its traffic as columns of numbers.

use serde_json::Value;

use crate::contact::case::read::faults::{AllowedRange, Faults};
use crate::contact::case::read::object::{Object, join, number, shown};
use crate::contact::case::read::subsurface::optional;
use crate::contact::case::read::wheel_rail::section;
use crate::contact::case::words::damage::DamageModel;
use crate::contact::case::words::evolution::{
    EvolutionAccuracy, EvolutionEvent, EvolutionExtent, EvolutionWords, WearLosses, WearingBodies,
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
const ANY: AllowedRange = AllowedRange::closed(-1e12, 1e12, "");
const LOSS: AllowedRange = AllowedRange::positive(100.0, "mm");
const SHARE: AllowedRange = AllowedRange::positive(1.0, "");
/// Events of one evolution.
const EVENTS_MAX: usize = 100;
/// Rows of a traffic.
pub const ROWS_MAX: usize = 200_000;
/// Samples of a traffic whose columns are distributions.
const SAMPLES_DEFAULT: usize = 4096;

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
    let wearing = or(all, "wearing", WearingBodies::Both, |all, name| {
        all.word(name, &BODIES, &[])
    });
    let model = DamageModel::UsfdWear;
    let wear_model = or(all, "wear_model", model, |all, name| {
        all.word(name, &MODELS, &[])
    });
    let extent = extent(&mut all.child("extent")?, wearing.unwrap_or_default());
    let records = or(all, "records", 10, |all, name| {
        all.required_count(name, 1, 500)
    });
    let usual = EvolutionAccuracy::default();
    let accuracy = or(all, "accuracy", usual, |all, name| {
        accuracy(&mut all.child(name)?)
    });
    let none = WearLosses::default();
    let limits = or(all, "limits", none, |all, name| {
        limits(&mut all.child(name)?)
    });
    let events = or(all, "events", Vec::new(), events);
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

/// A member that has a value where it is left out.
fn or<T>(
    block: &mut Object,
    name: &str,
    or: T,
    read: impl FnOnce(&mut Object, &str) -> Option<T>,
) -> Option<T> {
    optional(block, name, read).map(|found| found.unwrap_or(or))
}

fn number_or(block: &mut Object, name: &str, allowed: AllowedRange, usual: f64) -> Option<f64> {
    or(block, name, usual, |block, name| {
        block.number(name, allowed)
    })
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
    let usual = EvolutionAccuracy::default();
    let count_or = |block: &mut Object, name: &str, most: u32, usual: u32| {
        or(block, name, usual, |block, name| {
            block.required_count(name, 1, most)
        })
    };
    let depth = AllowedRange::positive(1.0, "mm");
    let kernel = AllowedRange::closed(0.0, 5.0, "mm");
    let states_max = count_or(block, "states_max", 2000, usual.states_max);
    let states_tolerance = number_or(block, "states_tolerance", SHARE, usual.states_tolerance);
    let step_tolerance = number_or(block, "step_tolerance", SHARE, usual.step_tolerance);
    let step_depth_mm = number_or(block, "step_depth_mm", depth, usual.step_depth_mm);
    let steps_max = count_or(block, "steps_max", 100_000, usual.steps_max);
    let smoothing_mm = number_or(block, "smoothing_mm", kernel, usual.smoothing_mm);
    Some(EvolutionAccuracy {
        states_max: states_max?,
        states_tolerance: states_tolerance?,
        step_tolerance: step_tolerance?,
        step_depth_mm: step_depth_mm?,
        steps_max: steps_max?,
        smoothing_mm: smoothing_mm?,
    })
}

fn limits(block: &mut Object) -> Option<WearLosses> {
    block.only(&WearLosses::NAMES, &[]);
    Some(WearLosses::from(
        WearLosses::NAMES.map(|name| block.number(name, LOSS)),
    ))
}

fn events(all: &mut Object, name: &str) -> Option<Vec<EvolutionEvent>> {
    let value = all.value(name)?;
    let pointer = all.pointer_to(name);
    let Some(elements) = value.as_array().filter(|list| list.len() <= EVENTS_MAX) else {
        let given = shown(value);
        let detail = format!("{given} given; an array of at most {EVENTS_MAX} events is needed");
        all.fault(name, detail);
        return None;
    };
    let faults = all.faults();
    let read = elements
        .iter()
        .enumerate()
        .map(|(k, element)| event(&mut Object::open(element, join(&pointer, k), faults)?));
    let read: Vec<Option<EvolutionEvent>> = read.collect();
    let mut events = read.into_iter().collect::<Option<Vec<EvolutionEvent>>>()?;
    events.sort_by(|a, b| a.at.total_cmp(&b.at));
    Some(events)
}

fn event(block: &mut Object) -> Option<EvolutionEvent> {
    let kinds = ["grind", "reprofile", "friction_coefficient"];
    block.only(&["at", kinds[0], kinds[1], kinds[2], "depth_mm"], &[]);
    let boxed = |block: &mut Object, name: &str| section(block, name).map(Box::new);
    let at = block.required_number("at", AllowedRange::closed(0.0, 1e12, ""));
    let grind = optional(block, kinds[0], boxed);
    let reprofile = optional(block, kinds[1], boxed);
    let depth = AllowedRange::closed(0.0, 20.0, "mm");
    let depth_mm = number_or(block, "depth_mm", depth, 0.0);
    let friction_coefficient = block.number(kinds[2], AllowedRange::closed(0.0, 2.0, ""));
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

type Traffic = (Vec<(String, Vec<f64>)>, Vec<f64>);

/// Columns and passes. A distribution is sampled once for each row.
fn traffic(block: &mut Object) -> Option<Traffic> {
    block.only(&["columns", "passes", "samples"], &[]);
    let most = ROWS_MAX as u32;
    let samples = optional(block, "samples", |block, name| {
        block.required_count(name, 1, most)
    })?;
    let value = block.required("columns", "an object of columns")?;
    let Some(members) = value.as_object().filter(|members| !members.is_empty()) else {
        let given = shown(value);
        block.fault(
            "columns",
            format!("{given} given; an object with at least one column is needed"),
        );
        return None;
    };
    let first = members.values().find_map(Value::as_array).map(Vec::len);
    let rows = samples.map(|samples| samples as usize).or(first);
    let rows = rows.unwrap_or(SAMPLES_DEFAULT);
    if !(1..=ROWS_MAX).contains(&rows) {
        block.fault(
            "columns",
            format!("{rows} rows given; 1 to {ROWS_MAX} are allowed"),
        );
        return None;
    }
    let pointer = block.pointer_to("columns");
    let faults = block.faults();
    let mut dimensions = PRIMES.into_iter();
    let read = members.iter().map(|(name, value)| {
        let pointer = join(&pointer, name);
        let values = match value {
            Value::Object(_) => {
                let mut block = Object::open(value, pointer, faults)?;
                sampled(&mut block, rows, dimensions.next())
            }
            _ => numbers(value, &pointer, (ANY, rows), faults),
        };
        Some((name.clone(), values?))
    });
    let read: Vec<Option<(String, Vec<f64>)>> = read.collect();
    let weight = AllowedRange::closed(0.0, 1e12, "");
    let passes = or(block, "passes", vec![1.0; rows], |block, name| {
        let pointer = block.pointer_to(name);
        numbers(block.value(name)?, &pointer, (weight, rows), block.faults())
    })?;
    if passes.iter().sum::<f64>() <= 0.0 {
        block.fault("passes", "all are 0; at least one more than 0 is needed");
    }
    Some((read.into_iter().collect::<Option<_>>()?, passes))
}

/// Samples of a distribution at the points of one dimension of Halton's sequence: uniform between two values, or normal where it has a mean and a
/// standard deviation.
fn sampled(block: &mut Object, rows: usize, dimension: Option<u32>) -> Option<Vec<f64>> {
    block.only(&["min", "max", "mean", "standard_deviation"], &[]);
    let Some(base) = dimension else {
        block.fault_here(format!(
            "at most {} distributions are allowed",
            PRIMES.len()
        ));
        return None;
    };
    let low = block.required_number("min", ANY);
    let high = block.required_number("max", AllowedRange::closed(low.unwrap_or(-1e12), 1e12, ""));
    let normal = match block.has("mean") || block.has("standard_deviation") {
        true => {
            let between = AllowedRange::closed(low?, high?, "");
            let mean = block.required_number("mean", between);
            let spread = AllowedRange::positive(1e12, "");
            let deviation = block.required_number("standard_deviation", spread);
            Some([mean?, deviation?])
        }
        false => None,
    };
    let (low, high) = (low?, high?);
    // The value below which this share of the traffic lies.
    let value = |share: f64| match normal {
        Some([mean, deviation]) => {
            let below = |value: f64| normal_probability((value - mean) / deviation);
            let probability = below(low) + share * (below(high) - below(low));
            (mean + deviation * normal_quantile(probability)).clamp(low, high)
        }
        None => low + share * (high - low),
    };
    Some((1..=rows).map(|k| value(halton(k as u32, base))).collect())
}

/// As many numbers as there are rows.
fn numbers(
    value: &Value,
    pointer: &str,
    (allowed, rows): (AllowedRange, usize),
    faults: &mut Faults,
) -> Option<Vec<f64>> {
    let Some(elements) = value.as_array().filter(|all| all.len() == rows) else {
        let detail = format!(
            "{} given; one number for each of {rows} rows is needed",
            shown(value)
        );
        faults.add(pointer, detail);
        return None;
    };
    let one = |(k, element)| number(element, &join(pointer, k), allowed, faults);
    let read: Vec<Option<f64>> = elements.iter().enumerate().map(one).collect();
    read.into_iter().collect()
}
