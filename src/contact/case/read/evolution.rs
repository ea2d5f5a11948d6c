//! Reads what is asked of an evolution: its plan, and its traffic as columns of numbers and distributions.

use serde_json::Value;

use crate::contact::case::read::object::{AllowedRange, Faults, Object, join, number, shown};
use crate::contact::case::read::wheel_rail::section_of;
use crate::contact::case::words::evolution::{
    EvolutionAccuracy, EvolutionEvent, EvolutionExtent, EvolutionWords, Traffic, TrafficColumn,
    TrafficDistribution, WearLosses, WearingBodies,
};
use crate::contact::case::words::subsurface::DamageModel;
use crate::contact::error::CaseError;
use crate::contact::numerics::quadrature::PRIMES;

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
const NOT_NEGATIVE: AllowedRange = AllowedRange::closed(0.0, 1e12, "");
const ANY: AllowedRange = AllowedRange::closed(-1e12, 1e12, "");
const LOSS: AllowedRange = AllowedRange::positive(100.0, "mm");
const DEPTH: AllowedRange = AllowedRange::closed(0.0, 20.0, "mm");
const FRICTION: AllowedRange = AllowedRange::closed(0.0, 2.0, "");
const SHARE: AllowedRange = AllowedRange::positive(1.0, "");
/// Events of one evolution.
const EVENTS_MAX: usize = 100;
/// Rows of a traffic.
const ROWS_MAX: u32 = 200_000;
/// Samples of a traffic whose columns are distributions.
const SAMPLES_DEFAULT: u32 = 4096;

impl EvolutionWords {
    /// Reads an evolution whose columns are named by JSON pointers into the template.
    ///
    /// # Errors
    /// Every fault of the text, with its JSON pointer.
    pub(crate) fn read(value: &Value) -> Result<EvolutionWords, CaseError> {
        let mut faults = Faults::default();
        let words =
            Object::open(value, String::new(), &mut faults).and_then(|mut all| words(&mut all));
        let faults = faults.into_list();
        words.filter(|_| faults.is_empty()).ok_or(CaseError(faults))
    }
}

// A faulty member is read as if it were left out: the fault refuses the evolution.

fn words(all: &mut Object) -> Option<EvolutionWords> {
    all.only(&MEMBERS);
    let template = all.required("template", "a case of one motion").cloned();
    let traffic = all.child("traffic").and_then(traffic);
    let wearing = all.word("wearing", &BODIES).unwrap_or_default();
    let extent = all.child("extent").map(|block| extent(block, wearing));
    let wear_model = all.word("wear_model", &MODELS);
    let factor = AllowedRange::closed(1.0, 100.0, "");
    Some(EvolutionWords {
        wearing,
        wear_model: wear_model.unwrap_or(DamageModel::UsfdWear),
        records: count_or(all, "records", 500, 10),
        accuracy: given(all, "accuracy").map(accuracy).unwrap_or_default(),
        limits: given(all, "limits").map(limits).unwrap_or_default(),
        events: events(all).unwrap_or_default(),
        coefficient_factor: number_or(all, "coefficient_factor", factor, 2.0),
        template: template?,
        traffic: traffic?,
        extent: extent?,
    })
}

/// An object that may be left out.
fn given<'v, 'o>(all: &'o mut Object<'v, '_>, name: &str) -> Option<Object<'v, 'o>> {
    all.value(name).and_then(|_| all.child(name))
}

fn number_or(block: &mut Object, name: &str, allowed: AllowedRange, usual: f64) -> f64 {
    block.number(name, allowed).unwrap_or(usual)
}

fn count_or(block: &mut Object, name: &str, most: u32, usual: u32) -> u32 {
    let found = block.value(name);
    let found = found.and_then(|_| block.required_count(name, 1, most));
    found.unwrap_or(usual)
}

fn extent(mut block: Object, wearing: WearingBodies) -> EvolutionExtent {
    block.only(&["mgt", "axle_passes", "wheel_distance_km"]);
    let [rail, wheel] = wearing.flags();
    if block.has("mgt") && block.has("axle_passes") {
        block.fault("axle_passes", "given together with mgt; give one of them");
    } else if rail && !block.has("axle_passes") {
        let what = "mgt or axle_passes, how much traffic passes over the rail";
        block.required("mgt", what);
    }
    if wheel {
        block.required("wheel_distance_km", "the distance that the wheel rolls");
    }
    EvolutionExtent {
        mgt: block.number("mgt", AMOUNT),
        axle_passes: block.number("axle_passes", AMOUNT),
        wheel_distance_km: block.number("wheel_distance_km", AMOUNT),
    }
}

fn accuracy(mut block: Object) -> EvolutionAccuracy {
    let names = [
        "states_max",
        "states_tolerance",
        "step_tolerance",
        "step_depth_mm",
        "steps_max",
        "smoothing_mm",
    ];
    let all = &mut block;
    all.only(&names);
    let usual = EvolutionAccuracy::default();
    let depth = AllowedRange::positive(1.0, "mm");
    let kernel = AllowedRange::closed(0.0, 5.0, "mm");
    EvolutionAccuracy {
        states_max: count_or(all, "states_max", 2000, usual.states_max),
        states_tolerance: number_or(all, "states_tolerance", SHARE, usual.states_tolerance),
        step_tolerance: number_or(all, "step_tolerance", SHARE, usual.step_tolerance),
        step_depth_mm: number_or(all, "step_depth_mm", depth, usual.step_depth_mm),
        steps_max: count_or(all, "steps_max", 100_000, usual.steps_max),
        smoothing_mm: number_or(all, "smoothing_mm", kernel, usual.smoothing_mm),
    }
}

fn limits(mut block: Object) -> WearLosses {
    block.only(&WearLosses::default().named().map(|(name, _)| name));
    WearLosses {
        height_mm: block.number("height_mm", LOSS),
        gauge_face_mm: block.number("gauge_face_mm", LOSS),
        gauge_corner_mm: block.number("gauge_corner_mm", LOSS),
        tread_mm: block.number("tread_mm", LOSS),
        flange_mm: block.number("flange_mm", LOSS),
    }
}

fn events(all: &mut Object) -> Option<Vec<EvolutionEvent>> {
    let value = all.value("events")?;
    let Some(elements) = value.as_array().filter(|list| list.len() <= EVENTS_MAX) else {
        let given = shown(value);
        let detail = format!("{given} given; an array of at most {EVENTS_MAX} events is needed");
        all.fault("events", detail);
        return None;
    };
    let pointer = all.pointer_to("events");
    let event = |(k, element)| event(Object::open(element, join(&pointer, k), all.faults())?);
    Some(elements.iter().enumerate().filter_map(event).collect())
}

fn event(mut block: Object) -> Option<EvolutionEvent> {
    let kinds = ["grind", "reprofile", "friction_coefficient"];
    block.only(&["at", kinds[0], kinds[1], kinds[2], "depth_mm"]);
    if kinds.iter().all(|kind| !block.has(kind)) {
        block.fault_here(format!("nothing happens; give one of {}", kinds.join(", ")));
    }
    let at = block.required_number("at", NOT_NEGATIVE);
    let [grind, reprofile] =
        [kinds[0], kinds[1]].map(|kind| section_of(&mut given(&mut block, kind)?).map(Box::new));
    Some(EvolutionEvent {
        grind,
        reprofile,
        depth_mm: number_or(&mut block, "depth_mm", DEPTH, 0.0),
        friction_coefficient: block.number(kinds[2], FRICTION),
        at: at?,
    })
}

fn traffic(mut block: Object) -> Option<Traffic> {
    block.only(&["columns", "passes", "samples"]);
    let samples = block.optional("samples", |block, name| {
        block.required_count(name, 1, ROWS_MAX)
    })?;
    let value = block.required("columns", "an object of columns")?;
    let members = value.as_object().filter(|members| !members.is_empty());
    let Some(members) = members else {
        let given = shown(value);
        let detail = format!("{given} given; an object with at least one column is needed");
        block.fault("columns", detail);
        return None;
    };
    let first = members.values().find_map(Value::as_array);
    let rows = samples.or(first.map(|first| first.len() as u32));
    let samples = rows.unwrap_or(SAMPLES_DEFAULT);
    if !(1..=ROWS_MAX).contains(&samples) {
        let detail = format!("{samples} rows given; 1 to {ROWS_MAX} are allowed");
        block.fault("columns", detail);
        return None;
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
    let (given, most) = (
        members.values().filter(|of| of.is_object()).count(),
        PRIMES.len(),
    );
    if given > most {
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

/// One number for each row.
fn numbers(block: &mut Object, name: &str, allowed: AllowedRange, rows: u32) -> Option<Vec<f64>> {
    let value = block.value(name)?;
    let Some(elements) = value.as_array().filter(|all| all.len() == rows as usize) else {
        let given = shown(value);
        let detail = format!("{given} given; one number for each of {rows} rows is needed");
        block.fault(name, detail);
        return None;
    };
    let pointer = block.pointer_to(name);
    let one = |(k, element)| number(element, &join(&pointer, k), allowed, block.faults());
    Some(elements.iter().enumerate().filter_map(one).collect())
}
