//! Reads `contact` and `load`: where the bodies touch and how hard they are pressed together.

use serde_json::Value;

use crate::contact::case::{Contact, Load};
use crate::contact::read::object::{Faults, Interval, Object, join, number, shown};

const RADIUS: Interval = Interval::positive(1e9, "mm");
const SEMI_AXIS: Interval = Interval::positive(1e6, "mm");
const NORMAL_FORCE: Interval = Interval::positive(1e12, "N");
const APPROACH: Interval = Interval::positive(1e6, "mm");
const COORDINATE: Interval = Interval::closed(-1e6, 1e6, "mm");
const PRESSURE: Interval = Interval::closed(0.0, 1e12, "MPa");
/// Points of one axis of a grid.
const AXIS_POINTS: std::ops::RangeInclusive<usize> = 2..=1000;
/// Neighbouring coordinates of an axis are at least this far apart, relative to the length of the axis and to the
/// largest coordinate: closer ones cannot be told apart in the arithmetic.
const SPACING_MIN: f64 = 1e-9;
const SPACING_TO_COORDINATE_MIN: f64 = 1e-12;
/// Neighbouring spacings differ by at most this factor; the edge of the contact cannot be told from more uneven samples.
const SPACING_RATIO_MAX: f64 = 1000.0;
/// Faulty values of one grid that are listed one by one.
const GRID_FAULTS_MAX: usize = 5;

#[derive(Clone, Copy)]
enum Kind {
    Radii,
    Ellipse,
    PressureGrid,
}

const KINDS: [(&str, Kind); 3] = [
    ("radii", Kind::Radii),
    ("ellipse", Kind::Ellipse),
    ("pressure_grid", Kind::PressureGrid),
];
const KINDS_LATER: [&str; 3] = ["gap_profile", "gap_grid", "profiles"];

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
        Kind::PressureGrid => {
            block.only(&["type", "x_mm", "y_mm", "pressure_mpa"], &[]);
            pressure_grid(&mut block)
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
    if !case.has("load") && kind != Some("radii") && kind != Some("ellipse") {
        return None;
    }
    let mut block = case.child("load")?;
    block.only(&["normal_force_n", "approach_mm"], &[]);
    let normal_force_n = block.number("normal_force_n", NORMAL_FORCE);
    let approach_mm = block.number("approach_mm", APPROACH);
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

fn pressure_grid(block: &mut Object) -> Option<Contact> {
    let x_mm = axis(block, "x_mm");
    let y_mm = axis(block, "y_mm");
    let length = |name| block.value(name).and_then(Value::as_array).map(Vec::len);
    let (nx, ny) = (length("x_mm"), length("y_mm"));
    let pressure_mpa = samples(block, nx, ny);
    Some(Contact::PressureGrid {
        x_mm: x_mm?,
        y_mm: y_mm?,
        pressure_mpa: pressure_mpa?,
    })
}

/// An axis of a grid: strictly increasing coordinates.
fn axis(block: &mut Object, name: &str) -> Option<Vec<f64>> {
    let (low, high) = (AXIS_POINTS.start(), AXIS_POINTS.end());
    let what = format!("an array of {low} to {high} strictly increasing coordinates in mm");
    let value = block.required(name, &what)?;
    let elements = value
        .as_array()
        .filter(|elements| AXIS_POINTS.contains(&elements.len()));
    let Some(elements) = elements else {
        block.fault(name, format!("{} given; {what} is needed", shown(value)));
        return None;
    };
    let pointer = block.pointer_to(name);
    let mut refused = 0;
    let axis = numbers(elements, &pointer, COORDINATE, &mut refused, block.faults());
    count_rest(&pointer, COORDINATE, refused, block.faults());
    let axis = axis?;
    let (first, last) = (axis[0], axis[axis.len() - 1]);
    let largest = first.abs().max(last.abs());
    let least = (SPACING_MIN * (last - first).abs()).max(SPACING_TO_COORDINATE_MIN * largest);
    let late = (1..axis.len()).find(|&i| axis[i] - axis[i - 1] <= least);
    if let Some(i) = late {
        block.faults().add(
            join(&pointer, i),
            format!(
                "{} given after {}; coordinates have to increase strictly, here by more than {least:e} mm",
                axis[i],
                axis[i - 1]
            ),
        );
        return None;
    }
    let uneven = axis.windows(3).position(|at| {
        let (before, after) = (at[1] - at[0], at[2] - at[1]);
        before.max(after) > SPACING_RATIO_MAX * before.min(after)
    });
    if let Some(i) = uneven {
        block.faults().add(
            join(&pointer, i + 2),
            format!(
                "{} given after {} and {}; neighbouring spacings may differ by a factor of at most {SPACING_RATIO_MAX}",
                axis[i + 2],
                axis[i],
                axis[i + 1]
            ),
        );
        return None;
    }
    Some(axis)
}

/// The samples of a grid with `nx` by `ny` points, where the axes are known.
fn samples(block: &mut Object, nx: Option<usize>, ny: Option<usize>) -> Option<Vec<Vec<f64>>> {
    const NAME: &str = "pressure_mpa";
    const ORDER: &str = "pressure_mpa[j][i] belongs to (x_mm[i], y_mm[j])";
    let what = format!("an array of rows, one per y_mm, each with one pressure per x_mm ({ORDER})");
    let value = block.required(NAME, &what)?;
    let rows: Option<Vec<&Vec<Value>>> = value
        .as_array()
        .and_then(|rows| rows.iter().map(Value::as_array).collect());
    let Some(rows) = rows.filter(|rows| !rows.is_empty()) else {
        block.fault(NAME, format!("{} given; {what} is needed", shown(value)));
        return None;
    };
    let pointer = block.pointer_to(NAME);
    let faults = block.faults();
    let width = rows[0].len();
    if let Some(j) = rows.iter().position(|row| row.len() != width) {
        faults.add(
            join(&pointer, j),
            format!(
                "a row of {} given after rows of {width}; all rows need the same length, one value per x_mm ({ORDER})",
                rows[j].len()
            ),
        );
        return None;
    }
    let (nx, ny) = (nx.unwrap_or(width), ny.unwrap_or(rows.len()));
    if (rows.len(), width) != (ny, nx) {
        let swapped = if (rows.len(), width) == (nx, ny) {
            "; the grid looks transposed"
        } else {
            ""
        };
        faults.add(
            pointer,
            format!(
                "{} rows of {width} values given; {ORDER}, so {ny} rows of {nx} values are needed{swapped}",
                rows.len()
            ),
        );
        return None;
    }
    let mut refused = 0;
    let read: Vec<Option<Vec<f64>>> = rows
        .iter()
        .enumerate()
        .map(|(j, row)| numbers(row, &join(&pointer, j), PRESSURE, &mut refused, faults))
        .collect();
    count_rest(&pointer, PRESSURE, refused, faults);
    read.into_iter().collect()
}

/// Numbers of an array; faulty ones are counted in `refused`, and listed as long as they are few.
fn numbers(
    elements: &[Value],
    pointer: &str,
    allowed: Interval,
    refused: &mut usize,
    faults: &mut Faults,
) -> Option<Vec<f64>> {
    let mut read = Vec::with_capacity(elements.len());
    for (i, value) in elements.iter().enumerate() {
        let good = value.as_f64().filter(|number| allowed.contains(*number));
        if let Some(good) = good {
            read.push(good + 0.0);
            continue;
        }
        *refused += 1;
        if *refused <= GRID_FAULTS_MAX {
            number(value, &join(pointer, i), allowed, faults);
        }
    }
    (read.len() == elements.len()).then_some(read)
}

/// Says how many faulty numbers were not listed.
fn count_rest(pointer: &str, allowed: Interval, refused: usize, faults: &mut Faults) {
    if refused > GRID_FAULTS_MAX {
        faults.add(
            pointer,
            format!(
                "{} more values here are not allowed; {allowed} is needed",
                refused - GRID_FAULTS_MAX
            ),
        );
    }
}
