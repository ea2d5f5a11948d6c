//! Reads `motion.history`: motions, forces and shifts in the distance rolled.

use serde_json::Value;

use crate::contact::case::read::faults::AllowedRange;
use crate::contact::case::read::object::{Object, join};
use crate::contact::case::words::motion::{
    History, HistoryCourse, HistoryStartName, Motions, Range,
};

const DISTANCE: AllowedRange = AllowedRange::closed(0.0, 1e9, "mm");
const CREEPAGE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "");
const SPIN: AllowedRange = AllowedRange::closed(-1e6, 1e6, "1/mm");
const FORCE: AllowedRange = AllowedRange::closed(-1e15, 1e15, "N");
const SHIFT: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const TURN: AllowedRange = AllowedRange::closed(-10.0, 10.0, "rad");
const SPEED: AllowedRange = AllowedRange::positive(1e9, "mm/s");
const SPEED_NAME: &str = "speed_mm_per_s";
/// Most points, before the limit of the service.
const POINTS_MAX: u32 = 1_000_000;
/// Components along x, across and about z; each force excludes its creepage and its shift.
const COMPONENTS: [(&str, AllowedRange); 8] = [
    ("creepage_x", CREEPAGE),
    ("creepage_y", CREEPAGE),
    ("spin_per_mm", SPIN),
    ("force_x_n", FORCE),
    ("force_y_n", FORCE),
    ("shift_x_mm", SHIFT),
    ("shift_y_mm", SHIFT),
    ("turn_rad", TURN),
];
/// Places of the shifts in [`COMPONENTS`].
const SHIFTS: std::ops::Range<usize> = 5..8;
const EXCLUSIVE: [(&str, [&str; 2]); 2] = [
    ("force_x_n", ["creepage_x", "shift_x_mm"]),
    ("force_y_n", ["creepage_y", "shift_y_mm"]),
];

/// Reads the block `{"history": …, "start": …}`.
pub(crate) fn read(block: &mut Object) -> Option<Motions> {
    block.only(&["history", "start"]);
    let start = block.optional_word("start", HistoryStartName::WORDS);
    let start = start.map(|start| start.unwrap_or(HistoryStartName::Rest));
    let history = history(&mut block.child("history")?, start);
    Some(Motions::History {
        history: history?,
        start: start?,
    })
}

fn history(block: &mut Object, start: Option<HistoryStartName>) -> Option<History> {
    let names = ["distance_mm", SPEED_NAME].into_iter();
    let names: Vec<&str> = names.chain(COMPONENTS.map(|(name, _)| name)).collect();
    block.only(&names);
    block.required("distance_mm", "an array of distances in mm")?;
    let distance_mm = course(block, "distance_mm", DISTANCE, None);
    let distances = distance_mm.as_ref().map(|course| course.values(1));
    let points = distances.as_ref().map(Vec::len);
    let mut read = [const { None }; COMPONENTS.len()];
    for (read, (name, allowed)) in read.iter_mut().zip(COMPONENTS) {
        if block.has(name) {
            *read = Some(course(block, name, allowed, points));
        }
    }
    let mut sound = !read.contains(&Some(None));
    let speed_mm_per_s = block.number(SPEED_NAME, SPEED);
    sound &= speed_mm_per_s.is_some() || !block.has(SPEED_NAME);
    for (force, others) in EXCLUSIVE {
        for other in others {
            if block.has(force) && block.has(other) {
                let detail =
                    format!("given together with {other}; a force is prescribed in its place");
                block.fault(force, detail);
                sound = false;
            }
        }
    }
    let needs_motion = start.is_some_and(|start| start != HistoryStartName::Pressed);
    if needs_motion && read.iter().all(Option::is_none) {
        let names = COMPONENTS.map(|(name, _)| name).join(", ");
        block.fault_here(format!(
            "no motion given; at least one of {names} is needed"
        ));
        return None;
    }
    let distances = distances?;
    sound &= increasing(block, &distances);
    for k in SHIFTS {
        if let Some(Some(course)) = &read[k] {
            sound &= shifted_at_rest(block, COMPONENTS[k].0, course, &distances, start?);
        }
    }
    let [
        creepage_x,
        creepage_y,
        spin_per_mm,
        force_x_n,
        force_y_n,
        shift_x_mm,
        shift_y_mm,
        turn_rad,
    ] = read.map(Option::flatten);
    sound.then_some(History {
        distance_mm: distance_mm?,
        creepage_x,
        creepage_y,
        spin_per_mm,
        force_x_n,
        force_y_n,
        speed_mm_per_s,
        shift_x_mm,
        shift_y_mm,
        turn_rad,
    })
}

/// Does the distance never decrease?
fn increasing(block: &mut Object, distances: &[f64]) -> bool {
    let pointer = block.pointer_to("distance_mm");
    let Some(k) = (1..distances.len()).find(|k| distances[*k] < distances[k - 1]) else {
        return true;
    };
    let detail = format!(
        "{} given after {}; distances may not decrease",
        distances[k],
        distances[k - 1]
    );
    block.faults().add(join(&pointer, k), detail);
    false
}

/// Is a shift 0 wherever the bodies roll, or begin in steady rolling?
fn shifted_at_rest(
    block: &mut Object,
    name: &str,
    course: &HistoryCourse,
    distances: &[f64],
    start: HistoryStartName,
) -> bool {
    let values = course.values(distances.len());
    let rolls = |k: usize| match k {
        0 => distances[0] > 0.0 || start == HistoryStartName::Steady,
        _ => distances[k] > distances[k - 1],
    };
    let wrong = (0..distances.len()).find(|k| values[*k] != 0.0 && rolls(*k));
    let Some(k) = wrong else { return true };
    let pointer = match course {
        HistoryCourse::Values(_) => join(&block.pointer_to(name), k),
        _ => block.pointer_to(name),
    };
    let detail = format!(
        "{} given for point {k}, to which the bodies roll; a shift belongs to a point with the distance of the point before, or to a first \
         point with the distance 0 that starts from \"rest\" or \"pressed\"",
        values[k]
    );
    block.faults().add(pointer, detail);
    false
}

/// A number, an array of one value per point, or `{"from": …, "to": …, "points": …}`.
fn course(
    block: &mut Object,
    name: &str,
    allowed: AllowedRange,
    points: Option<usize>,
) -> Option<HistoryCourse> {
    let found = match block.value(name)? {
        Value::Number(_) => return block.number(name, allowed).map(HistoryCourse::Constant),
        Value::Array(elements) if (1..=POINTS_MAX as usize).contains(&elements.len()) => {
            HistoryCourse::Values(block.numbers(name, elements, allowed)?)
        }
        Value::Object(_) => {
            let (from, to, points) = block.child(name)?.range(allowed, 2, POINTS_MAX)?;
            HistoryCourse::Range(Range { from, to, points })
        }
        _ => {
            let what = format!(
                "a number, an array of 1 to {POINTS_MAX} numbers or {{\"from\": …, \"to\": …, \"points\": …}}"
            );
            block.mistaken(name, &what);
            return None;
        }
    };
    let count = found.points();
    if let Some(points) = points.filter(|points| *points != count) {
        let detail = format!(
            "{count} values given for {points} distances; as many as distances are needed, or one number"
        );
        block.fault(name, detail);
        return None;
    }
    Some(found)
}
