//! Reads `contact` and `load`: where the bodies touch and how hard they are pressed together.
//!
//! Reads `material`: one set of elastic constants, or one for each body.

use serde_json::Value;

use crate::contact::case::read::object::{AllowedRange, Object, names, shown};
use crate::contact::case::read::samples::{SampleQuantity, axis, line, samples};
use crate::contact::case::read::{wheel_rail, wheelset};
use crate::contact::case::words::contact::{Contact, Elastic, Load, Material};

const RADIUS: AllowedRange = AllowedRange::positive(1e9, "mm");
const SEMI_AXIS: AllowedRange = AllowedRange::positive(1e6, "mm");
const FORCE: AllowedRange = AllowedRange::positive(1e12, "N");
const APPROACH: AllowedRange = AllowedRange::positive(1e6, "mm");
const APPROACH_OF_GAP: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
/// Members of a load; the first is for profiles only.
const LOADS: [&str; 3] = ["vertical_force_n", "normal_force_n", "approach_mm"];
const PRESSURE: SampleQuantity = SampleQuantity {
    member: "pressure_mpa",
    word: "pressure",
    allowed: AllowedRange::closed(0.0, 1e12, "MPa"),
};
const GAP: SampleQuantity = SampleQuantity {
    member: "gap_mm",
    word: "gap",
    allowed: AllowedRange::closed(-1e6, 1e6, "mm"),
};

#[derive(Clone, Copy)]
enum ContactWord {
    Radii,
    Ellipse,
    GapProfile,
    GapGrid,
    PressureGrid,
    Profiles,
    Wheelset,
}

const KINDS: [(&str, ContactWord); 7] = [
    ("radii", ContactWord::Radii),
    ("ellipse", ContactWord::Ellipse),
    ("gap_profile", ContactWord::GapProfile),
    ("gap_grid", ContactWord::GapGrid),
    ("pressure_grid", ContactWord::PressureGrid),
    ("profiles", ContactWord::Profiles),
    ("wheelset", ContactWord::Wheelset),
];

/// Reads the required member `contact` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Contact> {
    let mut block = case.child("contact")?;
    block.required("type", &format!("one of {}", names(&KINDS)))?;
    match block.word("type", &KINDS)? {
        ContactWord::Radii => {
            block.only(&["type", "rolling_mm", "lateral_mm"]);
            let rolling_mm = block.required_number("rolling_mm", RADIUS);
            let lateral_mm = block.required_number("lateral_mm", RADIUS);
            Some(Contact::Radii {
                rolling_mm: rolling_mm?,
                lateral_mm: lateral_mm?,
            })
        }
        ContactWord::Ellipse => {
            block.only(&["type", "a_mm", "b_mm"]);
            let a_mm = block.required_number("a_mm", SEMI_AXIS);
            let b_mm = block.required_number("b_mm", SEMI_AXIS);
            Some(Contact::Ellipse {
                a_mm: a_mm?,
                b_mm: b_mm?,
            })
        }
        ContactWord::GapProfile => {
            block.only(&["type", "rolling_mm", "y_mm", "gap_mm"]);
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
        ContactWord::GapGrid => {
            block.only(&["type", "x_mm", "y_mm", "gap_mm"]);
            let (x_mm, y_mm, gap_mm) = grid(&mut block, GAP);
            Some(Contact::GapGrid {
                x_mm: x_mm?,
                y_mm: y_mm?,
                gap_mm: gap_mm?,
            })
        }
        ContactWord::PressureGrid => {
            block.only(&["type", "x_mm", "y_mm", "pressure_mpa"]);
            let (x_mm, y_mm, pressure_mpa) = grid(&mut block, PRESSURE);
            Some(Contact::PressureGrid {
                x_mm: x_mm?,
                y_mm: y_mm?,
                pressure_mpa: pressure_mpa?,
            })
        }
        ContactWord::Profiles => wheel_rail::read(&mut block),
        ContactWord::Wheelset => wheelset::read(&mut block),
    }
}

/// Reads the member `load` of a case, which is needed or refused according to the type of the contact.
///
/// Where the type itself is faulty, only what is written is checked.
pub(crate) fn read_load(case: &mut Object) -> Option<Load> {
    let kind = case
        .value("contact")
        .and_then(|contact| contact.get("type"))
        .and_then(Value::as_str);
    match kind {
        Some("wheelset") => return wheelset::read_load(case, FORCE),
        Some("pressure_grid") => return no_load(case),
        _ => {}
    }
    let of_gap = matches!(kind, Some("gap_profile" | "gap_grid"));
    let of_profiles = kind == Some("profiles");
    if !case.has("load") && !of_gap && !of_profiles && !matches!(kind, Some("radii" | "ellipse")) {
        return None;
    }
    let mut block = case.child("load")?;
    let names = if of_profiles { &LOADS[..] } else { &LOADS[1..] };
    block.only_or(names, &LOADS[..1]);
    if !of_profiles && let Some(value) = block.value(LOADS[0]) {
        let value = shown(value);
        block.fault(
            LOADS[0],
            format!("{value} given for another contact than \"type\": \"profiles\"; give normal_force_n instead"),
        );
        return None;
    }
    let vertical_force_n = block.number("vertical_force_n", FORCE);
    let normal_force_n = block.number("normal_force_n", FORCE);
    let approach_mm = block.number(
        "approach_mm",
        if of_gap { APPROACH_OF_GAP } else { APPROACH },
    );
    let all = names.join(", ");
    match block.given(names)[..] {
        [] => {
            block.fault_here(format!("empty; exactly one of {all} is needed"));
            return None;
        }
        [_] => {}
        [first, second, ..] => {
            let detail = format!("given together with {first}; exactly one of {all} is allowed");
            block.fault(second, detail);
            return None;
        }
    }
    vertical_force_n.or(normal_force_n).or(approach_mm)?;
    Some(Load {
        normal_force_n,
        vertical_force_n,
        left_share: None,
        approach_mm,
    })
}

/// The load of a pressure that is given.
fn no_load(case: &mut Object) -> Option<Load> {
    if case.has("load") {
        case.fault(
            "load",
            "given together with a pressure_grid, which carries its own load; leave it out",
        );
    }
    None
}

type GridMembers = (Option<Vec<f64>>, Option<Vec<f64>>, Option<Vec<Vec<f64>>>);

/// Both axes of a grid and its samples.
fn grid(block: &mut Object, quantity: SampleQuantity) -> GridMembers {
    let x_mm = axis(block, "x_mm");
    let y_mm = axis(block, "y_mm");
    let (nx, ny) = (given(block, "x_mm"), given(block, "y_mm"));
    (x_mm, y_mm, samples(block, quantity, nx, ny))
}

/// Number of elements of an array, sound or not.
fn given(block: &Object, name: &str) -> Option<usize> {
    block.value(name).and_then(Value::as_array).map(Vec::len)
}

const MODULUS: AllowedRange = AllowedRange::positive(1e12, "MPa");
const POISSON_RATIO: AllowedRange = AllowedRange::closed(0.0, 0.5, "");

/// Reads the required member `material` of a case.
pub(crate) fn read_material(case: &mut Object) -> Option<Material> {
    let mut block = case.child("material")?;
    if !block.has("lower") && !block.has("upper") {
        return elastic(&mut block).map(Material::Same);
    }
    block.only(&["lower", "upper"]);
    let lower = block.child("lower").and_then(|mut body| elastic(&mut body));
    let upper = block.child("upper").and_then(|mut body| elastic(&mut body));
    Some(Material::Pair {
        lower: lower?,
        upper: upper?,
    })
}

fn elastic(block: &mut Object) -> Option<Elastic> {
    block.only(&["shear_modulus_mpa", "young_modulus_mpa", "poisson_ratio"]);
    let shear_modulus_mpa = block.number("shear_modulus_mpa", MODULUS);
    let young_modulus_mpa = block.number("young_modulus_mpa", MODULUS);
    let poisson_ratio = block.required_number("poisson_ratio", POISSON_RATIO);
    match (
        block.has("shear_modulus_mpa"),
        block.has("young_modulus_mpa"),
    ) {
        (false, false) => {
            block.fault(
                "shear_modulus_mpa",
                format!("missing; {MODULUS} is needed, or young_modulus_mpa instead"),
            );
            return None;
        }
        (true, true) => {
            block.exclude("shear_modulus_mpa", "young_modulus_mpa");
            return None;
        }
        _ => {}
    }
    shear_modulus_mpa.or(young_modulus_mpa)?;
    Some(Elastic {
        shear_modulus_mpa,
        young_modulus_mpa,
        poisson_ratio: poisson_ratio?,
    })
}
