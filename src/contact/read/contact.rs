//! Reads `contact` and `load`: where the bodies touch and how hard they are pressed together.

use serde_json::Value;

use crate::contact::case::{Contact, Load};
use crate::contact::read::object::{Interval, Object};
use crate::contact::read::samples::{Quantity, axis, line, samples};

const RADIUS: Interval = Interval::positive(1e9, "mm");
const SEMI_AXIS: Interval = Interval::positive(1e6, "mm");
const NORMAL_FORCE: Interval = Interval::positive(1e12, "N");
const APPROACH: Interval = Interval::positive(1e6, "mm");
const APPROACH_OF_GAP: Interval = Interval::closed(-1e6, 1e6, "mm");
const PRESSURE: Quantity = Quantity {
    member: "pressure_mpa",
    word: "pressure",
    allowed: Interval::closed(0.0, 1e12, "MPa"),
};
const GAP: Quantity = Quantity {
    member: "gap_mm",
    word: "gap",
    allowed: Interval::closed(-1e6, 1e6, "mm"),
};

#[derive(Clone, Copy)]
enum Kind {
    Radii,
    Ellipse,
    GapProfile,
    GapGrid,
    PressureGrid,
}

const KINDS: [(&str, Kind); 5] = [
    ("radii", Kind::Radii),
    ("ellipse", Kind::Ellipse),
    ("gap_profile", Kind::GapProfile),
    ("gap_grid", Kind::GapGrid),
    ("pressure_grid", Kind::PressureGrid),
];
const KINDS_LATER: [&str; 1] = ["profiles"];

/// Reads the required member `contact` of a case.
pub(super) fn read(case: &mut Object) -> Option<Contact> {
    let mut block = case.child("contact")?;
    let words = KINDS.map(|(word, _)| word).join(", ");
    block.required("type", &format!("one of {words}"))?;
    match block.word("type", &KINDS, &KINDS_LATER)? {
        Kind::Radii => {
            block.only(&["type", "rolling_mm", "lateral_mm"], &[]);
            let rolling_mm = block.required_number("rolling_mm", RADIUS);
            let lateral_mm = block.required_number("lateral_mm", RADIUS);
            Some(Contact::Radii {
                rolling_mm: rolling_mm?,
                lateral_mm: lateral_mm?,
            })
        }
        Kind::Ellipse => {
            block.only(&["type", "a_mm", "b_mm"], &[]);
            let a_mm = block.required_number("a_mm", SEMI_AXIS);
            let b_mm = block.required_number("b_mm", SEMI_AXIS);
            Some(Contact::Ellipse {
                a_mm: a_mm?,
                b_mm: b_mm?,
            })
        }
        Kind::GapProfile => {
            block.only(&["type", "rolling_mm", "y_mm", "gap_mm"], &[]);
            let rolling_mm = block.required_number("rolling_mm", RADIUS);
            let y_mm = axis(&mut block, "y_mm");
            let points = given(&block, "y_mm");
            let gap_mm = line(&mut block, GAP, points);
            Some(Contact::GapProfile {
                rolling_mm: rolling_mm?,
                y_mm: y_mm?,
                gap_mm: gap_mm?,
            })
        }
        Kind::GapGrid => {
            block.only(&["type", "x_mm", "y_mm", "gap_mm"], &[]);
            let (x_mm, y_mm, gap_mm) = grid(&mut block, GAP);
            Some(Contact::GapGrid {
                x_mm: x_mm?,
                y_mm: y_mm?,
                gap_mm: gap_mm?,
            })
        }
        Kind::PressureGrid => {
            block.only(&["type", "x_mm", "y_mm", "pressure_mpa"], &[]);
            let (x_mm, y_mm, pressure_mpa) = grid(&mut block, PRESSURE);
            Some(Contact::PressureGrid {
                x_mm: x_mm?,
                y_mm: y_mm?,
                pressure_mpa: pressure_mpa?,
            })
        }
    }
}

/// Reads the member `load` of a case, which is needed or refused according to the type of the contact.
///
/// Where the type itself is faulty, only what is written is checked.
pub(super) fn read_load(case: &mut Object) -> Option<Load> {
    let kind = case
        .value("contact")
        .and_then(|contact| contact.get("type"))
        .and_then(Value::as_str);
    if kind == Some("pressure_grid") {
        if case.has("load") {
            case.fault(
                "load",
                "given together with a pressure_grid, which carries its own load; leave it out",
            );
        }
        return None;
    }
    let of_gap = matches!(kind, Some("gap_profile" | "gap_grid"));
    if !case.has("load") && !of_gap && !matches!(kind, Some("radii" | "ellipse")) {
        return None;
    }
    let mut block = case.child("load")?;
    block.only(&["normal_force_n", "approach_mm"], &[]);
    let normal_force_n = block.number("normal_force_n", NORMAL_FORCE);
    let approach_mm = block.number(
        "approach_mm",
        if of_gap { APPROACH_OF_GAP } else { APPROACH },
    );
    match (block.has("normal_force_n"), block.has("approach_mm")) {
        (false, false) => {
            block.fault_here("empty; exactly one of normal_force_n, approach_mm is needed");
            return None;
        }
        (true, true) => {
            block.fault(
                "approach_mm",
                "given together with normal_force_n; exactly one of the two is allowed",
            );
            return None;
        }
        _ => {}
    }
    normal_force_n.or(approach_mm)?;
    Some(Load {
        normal_force_n,
        approach_mm,
    })
}

type Grid = (Option<Vec<f64>>, Option<Vec<f64>>, Option<Vec<Vec<f64>>>);

/// Both axes of a grid and its samples.
fn grid(block: &mut Object, quantity: Quantity) -> Grid {
    let x_mm = axis(block, "x_mm");
    let y_mm = axis(block, "y_mm");
    let (nx, ny) = (given(block, "x_mm"), given(block, "y_mm"));
    (x_mm, y_mm, samples(block, quantity, nx, ny))
}

/// Number of elements of an array, sound or not.
fn given(block: &Object, name: &str) -> Option<usize> {
    block.value(name).and_then(Value::as_array).map(Vec::len)
}
