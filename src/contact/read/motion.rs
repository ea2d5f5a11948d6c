//! Reads `motion`: one motion, a list of motions, or a sweep.

use serde_json::Value;

use crate::contact::case::{Combine, Motion, Motions, Range, Sweep};
use crate::contact::read::object::{Faults, Interval, Object, join, shown};

const CREEPAGE: Interval = Interval::closed(-1e6, 1e6, "");
const SPIN: Interval = Interval::closed(-1e6, 1e6, "1/mm");
const POINTS_MAX: u32 = 1_000_000;
const COMPONENTS: [&str; 3] = ["creepage_x", "creepage_y", "spin_per_mm"];
const FORCES: [&str; 2] = ["force_x_n", "force_y_n"];

/// Reads the required member `motion` of a case.
pub(super) fn read(case: &mut Object) -> Option<Motions> {
    let what = "an object with at least one of creepage_x, creepage_y, spin_per_mm, an array of such objects, or {\"sweep\": …}";
    let value = case.required("motion", what)?;
    let pointer = case.pointer_to("motion");
    let faults = case.faults();
    match value {
        Value::Object(members) if members.contains_key("sweep") => {
            let mut block = Object::open(value, pointer, faults)?;
            block.only(&["sweep"], &[]);
            let sweep = sweep(&mut block.child("sweep")?)?;
            Some(Motions::Sweep { sweep })
        }
        Value::Object(_) => motion(value, pointer, faults).map(Motions::One),
        Value::Array(elements) if !elements.is_empty() => {
            let motions: Vec<Option<Motion>> = elements
                .iter()
                .enumerate()
                .map(|(k, element)| motion(element, join(&pointer, k), faults))
                .collect();
            motions
                .into_iter()
                .collect::<Option<_>>()
                .map(Motions::Many)
        }
        _ => {
            faults.add(pointer, format!("{} given; {what} is needed", shown(value)));
            None
        }
    }
}

fn motion(value: &Value, pointer: String, faults: &mut Faults) -> Option<Motion> {
    let mut block = Object::open(value, pointer, faults)?;
    let mut read = [Some(0.0); 3];
    components(&mut block, &[], |block, k, name| {
        read[k] = block.number(name, interval(k));
    })?;
    let [creepage_x, creepage_y, spin_per_mm] = read;
    Some(Motion {
        creepage_x: creepage_x?,
        creepage_y: creepage_y?,
        spin_per_mm: spin_per_mm?,
    })
}

fn sweep(block: &mut Object) -> Option<Sweep> {
    let mut read = [None; 3];
    components(block, &["combine"], |block, k, name| {
        read[k] = Some(range(block, k, name));
    })?;
    let combine = block.word(
        "combine",
        &[("together", Combine::Together), ("grid", Combine::Grid)],
        &[],
    );
    if block.has("combine") {
        combine?;
    }
    // A faulty range has left its fault behind and ends the reading here.
    let mut ranges = [None; 3];
    for (range, read) in ranges.iter_mut().zip(read) {
        *range = match read {
            Some(None) => return None,
            Some(range) => range,
            None => None,
        };
    }
    let [creepage_x, creepage_y, spin_per_mm] = ranges;
    let combine = combine.unwrap_or_default();
    if combine == Combine::Together {
        let points: Vec<u32> = ranges
            .iter()
            .flatten()
            .map(|range: &Range| range.points)
            .collect();
        if points.iter().any(|n| *n != points[0]) {
            block.fault_here(format!(
                "ranges with {} points given; ranges that run together need equally many (or use \"combine\": \"grid\")",
                points.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
            ));
            return None;
        }
    }
    Some(Sweep {
        creepage_x,
        creepage_y,
        spin_per_mm,
        combine,
    })
}

/// Visits the components that are written and refuses everything else; `None` if no motion is described.
fn components(
    block: &mut Object,
    beside: &[&str],
    mut visit: impl FnMut(&mut Object, usize, &'static str),
) -> Option<()> {
    let allowed: Vec<&str> = COMPONENTS.iter().chain(beside).copied().collect();
    block.only(&allowed, &FORCES);
    for name in FORCES {
        if let Some(value) = block.value(name) {
            let value = shown(value);
            block.fault(
                name,
                format!("{value} given; prescribed tangential forces are not offered by this version, give a creepage"),
            );
        }
    }
    for (k, name) in COMPONENTS.into_iter().enumerate() {
        if block.has(name) {
            visit(block, k, name);
        }
    }
    let forces = FORCES.iter().any(|name| block.has(name));
    if !forces && !COMPONENTS.iter().any(|name| block.has(name)) {
        block.fault_here(format!(
            "no motion given; at least one of {} is needed (write out zeros)",
            COMPONENTS.join(", ")
        ));
        return None;
    }
    (!forces).then_some(())
}

fn range(block: &mut Object, k: usize, name: &str) -> Option<Range> {
    let mut block = block.child(name)?;
    block.only(&["from", "to", "points"], &[]);
    let from = block.required_number("from", interval(k));
    let to = block.required_number("to", interval(k));
    let points = block.required_count("points", 1, POINTS_MAX);
    let (from, to, points) = (from?, to?, points?);
    if points == 1 && from.to_bits() != to.to_bits() {
        block.fault(
            "points",
            format!("1 given for a range from {from} to {to}; at least 2 points are needed unless from equals to"),
        );
        return None;
    }
    Some(Range { from, to, points })
}

fn interval(component: usize) -> Interval {
    if component == 2 { SPIN } else { CREEPAGE }
}
