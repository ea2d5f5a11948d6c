//! Reads `motion`: one motion, a list of motions, a sweep, a history or a wheelset.
//!
//! Reads `motion.history`: motions, forces and shifts in the distance rolled.

use serde_json::Value;

use crate::contact::case::read::object::{AllowedRange, Faults, Object, join, shown};
use crate::contact::case::words::motion::{
    AskedMotion, Combine, History, HistoryCourse, HistoryStartName, Motions, Range, Sweep, Swept,
    ValueList, Wheelset,
};

const CREEPAGE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "");
const SPIN: AllowedRange = AllowedRange::closed(-1e6, 1e6, "1/mm");
const SPEED: AllowedRange = AllowedRange::positive(1e9, "mm/s");
const VELOCITY: AllowedRange = AllowedRange::closed(-1e9, 1e9, "mm/s");
const RATE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "rad/s");
const RADIUS: AllowedRange = AllowedRange::positive(1e9, "mm");
const TORQUE: AllowedRange = AllowedRange::closed(-1e15, 1e15, "N mm");
/// Most motions of a sweep and points of a history, before the limit of the service.
const POINTS_MAX: u32 = 1_000_000;
const FORCE: AllowedRange = AllowedRange::closed(-1e15, 1e15, "N");
/// The forces stand in the order of the creepages they replace.
const COMPONENTS: [&str; 5] = [
    "creepage_x",
    "creepage_y",
    "spin_per_mm",
    "force_x_n",
    "force_y_n",
];
/// The member beside them.
const SPEED_NAME: &str = "speed_mm_per_s";
/// The lateral velocity of a wheelset, and the force that may stand in its place.
const LATERAL_NAME: &str = "lateral_velocity_mm_per_s";
/// See [`LATERAL_NAME`].
const ACROSS_NAME: &str = "force_y_n";
/// Place of the spin in [`COMPONENTS`].
const SPIN_AT: usize = 2;
/// Place of the first force.
const FORCES_FROM: usize = 3;

/// Reads the required member `motion` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Motions> {
    let what = "an object with at least one of creepage_x, creepage_y, spin_per_mm, force_x_n, force_y_n, an array of such objects, {\"sweep\": …} or {\"history\": …}";
    let value = case.required("motion", what)?;
    let kind = case
        .value("contact")
        .and_then(|contact| contact.get("type"));
    let kind = kind.and_then(Value::as_str);
    let (of_profiles, of_wheelset) = (kind == Some("profiles"), kind == Some("wheelset"));
    let pointer = case.pointer_to("motion");
    let faults = case.faults();
    match value {
        Value::Object(members) if members.contains_key("sweep") && !of_wheelset => {
            let mut block = Object::open(value, pointer, faults)?;
            block.only(&["sweep"]);
            let sweep = sweep(&mut block.child("sweep")?)?;
            Some(Motions::Sweep { sweep })
        }
        Value::Object(members) if members.contains_key("history") => {
            read_history(&mut Object::open(value, pointer, faults)?)
        }
        Value::Object(members) if members.contains_key("wheelset") => {
            let mut block = Object::open(value, pointer, faults)?;
            block.only(&["wheelset"]);
            if !of_profiles && !of_wheelset {
                block.fault(
                    "wheelset",
                    "given for another contact than \"type\": \"profiles\" or \"wheelset\"; give creepages instead",
                );
                return None;
            }
            match members.get("wheelset") {
                Some(Value::Array(motions)) if of_wheelset && !motions.is_empty() => {
                    let pointer = block.pointer_to("wheelset");
                    wheelsets(motions, &pointer, block.faults())
                }
                _ => {
                    let wheelset = wheelset(&mut block.child("wheelset")?, of_wheelset)?;
                    Some(Motions::Wheelset { wheelset })
                }
            }
        }
        _ if of_wheelset => {
            let what = "the motion of the wheelset is needed, such as {\"wheelset\": {\"speed_mm_per_s\": 20000, \"drive_torque_n_mm\": 0}}, from which \
                        every patch gets its own creepages";
            faults.add(pointer, format!("{} given; {what}", shown(value)));
            None
        }
        Value::Object(_) => motion(value, pointer, faults).map(Motions::One),
        Value::Array(elements) if !elements.is_empty() => {
            let motions: Vec<Option<AskedMotion>> = elements
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

fn motion(value: &Value, pointer: String, faults: &mut Faults) -> Option<AskedMotion> {
    let mut block = Object::open(value, pointer, faults)?;
    let mut read = [None; COMPONENTS.len()];
    components(&mut block, &[SPEED_NAME], |block, k, name| {
        read[k] = Some(block.number(name, interval(k)));
    })?;
    let speed_mm_per_s = block.optional_number(SPEED_NAME, SPEED)?;
    // A faulty number has left its fault behind and ends the reading here.
    if read.contains(&Some(None)) {
        return None;
    }
    let [x, y, spin, force_x_n, force_y_n] = read.map(Option::flatten);
    let left_out = |force: Option<f64>| force.is_none().then_some(0.0);
    Some(AskedMotion {
        creepage_x: x.or(left_out(force_x_n)),
        creepage_y: y.or(left_out(force_y_n)),
        spin_per_mm: spin.unwrap_or(0.0),
        force_x_n,
        force_y_n,
        speed_mm_per_s,
    })
}

/// Several motions of a wheelset on both rails.
fn wheelsets(motions: &[Value], pointer: &str, faults: &mut Faults) -> Option<Motions> {
    let read: Vec<Option<Wheelset>> = motions
        .iter()
        .enumerate()
        .map(|(k, motion)| {
            let mut block = Object::open(motion, join(pointer, k), faults)?;
            wheelset(&mut block, true)
        })
        .collect();
    let wheelset = read.into_iter().collect::<Option<_>>()?;
    Some(Motions::Wheelsets { wheelset })
}

/// The motion of a wheelset; on both rails a torque can be balanced, on one a longitudinal and a lateral force.
fn wheelset(block: &mut Object, on_both_rails: bool) -> Option<Wheelset> {
    const TORQUE_NAME: (&str, AllowedRange) = ("drive_torque_n_mm", TORQUE);
    const FORCE_NAME: (&str, AllowedRange) = ("force_x_n", FORCE);
    const RATES: [(&str, AllowedRange); 3] = [
        (LATERAL_NAME, VELOCITY),
        ("yaw_rate_rad_per_s", RATE),
        ("roll_rate_rad_per_s", RATE),
    ];
    let spins = [
        ("angular_velocity_rad_per_s", RATE),
        ("free_rolling_radius_mm", RADIUS),
        if on_both_rails {
            TORQUE_NAME
        } else {
            FORCE_NAME
        },
    ];
    let names = spins.iter().chain(&RATES).map(|(name, _)| *name);
    let across = (!on_both_rails).then_some(ACROSS_NAME);
    let names: Vec<&str> = [SPEED_NAME]
        .into_iter()
        .chain(names)
        .chain(across)
        .collect();
    block.only(&names);
    let speed_mm_per_s = block.required_number(SPEED_NAME, SPEED);
    let mut spin = [None; 3];
    for (k, (name, allowed)) in spins.iter().enumerate() {
        spin[k] = block.number(name, *allowed);
    }
    let rates = RATES.map(|(name, allowed)| block.number_or(name, allowed, 0.0));
    let force_y_n = across_of_wheelset(block, on_both_rails);
    turning_is_said_once(block, spins.map(|(name, _)| name))?;
    let [angular_velocity_rad_per_s, free_rolling_radius_mm, balanced] = spin;
    spin.into_iter().flatten().next()?;
    let [lateral, yaw, roll] = rates;
    let (lateral, force_y_n) = (lateral?, force_y_n?);
    Some(Wheelset {
        speed_mm_per_s: speed_mm_per_s?,
        angular_velocity_rad_per_s,
        free_rolling_radius_mm,
        drive_torque_n_mm: balanced.filter(|_| on_both_rails),
        force_x_n: balanced.filter(|_| !on_both_rails),
        lateral_velocity_mm_per_s: force_y_n.is_none().then_some(lateral),
        force_y_n,
        yaw_rate_rad_per_s: yaw?,
        roll_rate_rad_per_s: roll?,
    })
}

/// Faults unless exactly one of the members that say how fast a wheelset turns is given.
fn turning_is_said_once(block: &mut Object, names: [&str; 3]) -> Option<()> {
    match block.given(&names)[..] {
        [_] => Some(()),
        [] => {
            let others = names[1..].join(" or ");
            block.fault(
                names[0],
                format!("missing; {RATE} is needed, or {others} instead"),
            );
            None
        }
        [first, second, ..] => {
            block.exclude(first, second);
            None
        }
    }
}

/// The lateral force in place of the lateral velocity, which may be left out; the outer `None` says that it is faulty.
fn across_of_wheelset(block: &mut Object, on_both_rails: bool) -> Option<Option<f64>> {
    if on_both_rails || !block.has(ACROSS_NAME) {
        return Some(None);
    }
    let force = block.number(ACROSS_NAME, FORCE);
    if block.has(LATERAL_NAME) {
        block.exclude(LATERAL_NAME, ACROSS_NAME);
        return None;
    }
    force.map(Some)
}

fn sweep(block: &mut Object) -> Option<Sweep> {
    let mut read = [const { None }; COMPONENTS.len()];
    components(block, &["combine", SPEED_NAME], |block, k, name| {
        read[k] = Some(swept(block, name, interval(k)));
    })?;
    let speed_mm_per_s = block.optional_number(SPEED_NAME, SPEED)?;
    let combine = block.optional_word("combine", Combine::WORDS)?;
    // A faulty component has left its fault behind and ends the reading here.
    if read.contains(&Some(None)) {
        return None;
    }
    let [creepage_x, creepage_y, spin_per_mm, force_x_n, force_y_n] = read.map(Option::flatten);
    let sweep = Sweep {
        creepage_x,
        creepage_y,
        spin_per_mm,
        force_x_n,
        force_y_n,
        speed_mm_per_s,
        combine: combine.unwrap_or_default(),
    };
    if sweep.combine == Combine::Together {
        let points: Vec<usize> = components_of(&sweep)
            .into_iter()
            .flatten()
            .map(Swept::points)
            .collect();
        let mut varying = points.iter().filter(|points| **points > 1);
        let first = varying.next();
        if varying.any(|points| Some(points) != first) {
            block.fault_here(format!(
                "components with {} values given; components combined \"together\" need the same number of values, which \"combine\": \"grid\" does not",
                points.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
            ));
            return None;
        }
    }
    Some(sweep)
}

fn components_of(sweep: &Sweep) -> [Option<&Swept>; COMPONENTS.len()] {
    [
        &sweep.creepage_x,
        &sweep.creepage_y,
        &sweep.spin_per_mm,
        &sweep.force_x_n,
        &sweep.force_y_n,
    ]
    .map(Option::as_ref)
}

/// Visits the components that are written and refuses everything else; `None` if no motion is described.
fn components(
    block: &mut Object,
    beside: &[&str],
    mut visit: impl FnMut(&mut Object, usize, &'static str),
) -> Option<()> {
    let allowed: Vec<&str> = COMPONENTS.iter().chain(beside).copied().collect();
    block.only(&allowed);
    let (creepages, forces) = (&COMPONENTS[..SPIN_AT], &COMPONENTS[FORCES_FROM..]);
    let mut both = false;
    for (creepage, force) in creepages.iter().zip(forces) {
        if block.has(creepage) && block.has(force) {
            block.exclude(creepage, force);
            both = true;
        }
    }
    for (k, name) in COMPONENTS.into_iter().enumerate() {
        if block.has(name) {
            visit(block, k, name);
        }
    }
    if !COMPONENTS.iter().any(|name| block.has(name)) {
        block.fault_here(format!(
            "no motion given; at least one of {} is needed, with the value 0 if nothing moves",
            COMPONENTS.join(", ")
        ));
        return None;
    }
    (!both).then_some(())
}

/// A number, `{"from": …, "to": …, "points": …}` or `{"values": […]}`.
pub(crate) fn swept(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Swept> {
    let what = "a number, {\"from\": …, \"to\": …, \"points\": …} or {\"values\": […]}";
    match block.value(name)? {
        Value::Number(_) => block.number(name, allowed).map(Swept::Constant),
        Value::Object(members) if members.contains_key("values") => {
            list(block, name, allowed).map(Swept::List)
        }
        Value::Object(_) => range(block, name, allowed).map(Swept::Range),
        _ => {
            block.mistaken(name, what);
            None
        }
    }
}

fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<ValueList> {
    let mut block = block.child(name)?;
    block.only(&["values"]);
    let what = format!("an array of 1 to {POINTS_MAX} numbers");
    let elements = block.array("values", 1..=POINTS_MAX as usize, &what)?;
    let values = block.numbers("values", elements, allowed)?;
    Some(ValueList { values })
}

fn range(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Range> {
    let mut block = block.child(name)?;
    let (from, to, points) = block.range(allowed, 1, POINTS_MAX)?;
    if points == 1 && from.to_bits() != to.to_bits() {
        block.fault(
            "points",
            format!("1 given for a range from {from} to {to}; at least 2 points are needed unless from equals to"),
        );
        return None;
    }
    Some(Range { from, to, points })
}

fn interval(component: usize) -> AllowedRange {
    match component {
        SPIN_AT => SPIN,
        FORCES_FROM.. => FORCE,
        _ => CREEPAGE,
    }
}

const DISTANCE: AllowedRange = AllowedRange::closed(0.0, 1e9, "mm");
const SHIFT: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const TURN: AllowedRange = AllowedRange::closed(-10.0, 10.0, "rad");
/// Components along x, across and about z; each force excludes its creepage and its shift.
const HISTORY_COMPONENTS: [(&str, AllowedRange); 8] = [
    ("creepage_x", CREEPAGE),
    ("creepage_y", CREEPAGE),
    ("spin_per_mm", SPIN),
    ("force_x_n", FORCE),
    ("force_y_n", FORCE),
    ("shift_x_mm", SHIFT),
    ("shift_y_mm", SHIFT),
    ("turn_rad", TURN),
];
/// Places of the shifts in [`HISTORY_COMPONENTS`].
const SHIFTS: std::ops::Range<usize> = 5..8;
const EXCLUSIVE: [(&str, [&str; 2]); 2] = [
    ("force_x_n", ["creepage_x", "shift_x_mm"]),
    ("force_y_n", ["creepage_y", "shift_y_mm"]),
];

/// Reads the block `{"history": …, "start": …}`.
pub(crate) fn read_history(block: &mut Object) -> Option<Motions> {
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
    let names: Vec<&str> = names
        .chain(HISTORY_COMPONENTS.map(|(name, _)| name))
        .collect();
    block.only(&names);
    block.required("distance_mm", "an array of distances in mm")?;
    let distance_mm = course(block, "distance_mm", DISTANCE, None);
    let distances = distance_mm.as_ref().map(|course| course.values(1));
    let points = distances.as_ref().map(Vec::len);
    let mut read = [const { None }; HISTORY_COMPONENTS.len()];
    for (read, (name, allowed)) in read.iter_mut().zip(HISTORY_COMPONENTS) {
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
        let names = HISTORY_COMPONENTS.map(|(name, _)| name).join(", ");
        block.fault_here(format!(
            "no motion given; at least one of {names} is needed"
        ));
        return None;
    }
    let distances = distances?;
    sound &= increasing(block, &distances);
    for k in SHIFTS {
        if let Some(Some(course)) = &read[k] {
            sound &= shifted_at_rest(block, HISTORY_COMPONENTS[k].0, course, &distances, start?);
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
