//! Reads samples over one or two axes, and the axes.

use serde_json::Value;

use crate::case::words::object::{AllowedRange, Object, count_rest, join, numbers};

const COORDINATE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
/// Points of one axis of a grid, and of a coefficient of friction across, along or by temperature.
pub(crate) const AXIS_POINTS: std::ops::RangeInclusive<usize> = 2..=1000;
/// Least distance of neighbouring coordinates of an axis, relative to the length of the axis: closer ones cannot be told apart in the
/// arithmetic.
const SPACING_MIN: f64 = 1e-9;
/// The same relative to the largest coordinate.
const SPACING_TO_COORDINATE_MIN: f64 = 1e-12;
/// Neighbouring spacings differ by at most this factor; the edge of the contact cannot be told from more uneven samples.
const SPACING_RATIO_MAX: f64 = 1000.0;

/// An axis of a grid: strictly increasing coordinates.
pub(crate) fn axis(block: &mut Object, name: &str) -> Option<Vec<f64>> {
    let (low, high) = (AXIS_POINTS.start(), AXIS_POINTS.end());
    let what = format!("an array of {low} to {high} strictly increasing coordinates in mm");
    block.required(name, &what)?;
    let elements = block.array(name, AXIS_POINTS, &what)?;
    let axis = block.numbers(name, elements, COORDINATE)?;
    let pointer = block.pointer_to(name);
    let (first, last) = (axis[0], axis[axis.len() - 1]);
    let largest = first.abs().max(last.abs());
    let least = (SPACING_MIN * (last - first).abs()).max(SPACING_TO_COORDINATE_MIN * largest);
    let late = (1..axis.len()).find(|&i| axis[i] - axis[i - 1] <= least);
    if let Some(i) = late {
        block.faults().add(
            join(&pointer, i),
            format!(
                "{} given after {}; coordinates must increase strictly, each by more than {least:e} mm",
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

const GAP: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const PRESSURE: AllowedRange = AllowedRange::closed(0.0, 1e12, "MPa");

/// Number of elements of an array, sound or not.
fn given(block: &Object, name: &str) -> Option<usize> {
    block.value(name).and_then(Value::as_array).map(Vec::len)
}

/// A gap at every `y_mm`.
pub(crate) fn gap_line(block: &mut Object, member: &str) -> Option<Vec<f64>> {
    let n = given(block, "y_mm");
    let what = "an array with one gap per y_mm";
    let value = block.required(member, what)?;
    let Some(elements) = value.as_array() else {
        block.mistaken(member, what);
        return None;
    };
    let n = n.unwrap_or(elements.len());
    if elements.len() != n {
        block.fault(
            member,
            format!(
                "{} values given; {what} is needed, which are {n}",
                elements.len()
            ),
        );
        return None;
    }
    block.numbers(member, elements, GAP)
}

/// A gap at every point of a grid.
pub(crate) fn gap_grid(block: &mut Object, member: &str) -> Option<Vec<Vec<f64>>> {
    grid(block, member, "gap", GAP)
}

/// A pressure at every point of a grid.
pub(crate) fn pressure_grid(block: &mut Object, member: &str) -> Option<Vec<Vec<f64>>> {
    grid(block, member, "pressure", PRESSURE)
}

/// The samples of a grid over `x_mm` and `y_mm`; `word` names one of them.
fn grid(
    block: &mut Object,
    member: &str,
    word: &str,
    allowed: AllowedRange,
) -> Option<Vec<Vec<f64>>> {
    let (nx, ny) = (given(block, "x_mm"), given(block, "y_mm"));
    let order = format!("{member}[j][i] belongs to (x_mm[i], y_mm[j])");
    let what = format!("an array of rows, one per y_mm, each with one {word} per x_mm ({order})");
    let value = block.required(member, &what)?;
    let rows: Option<Vec<&Vec<Value>>> = value
        .as_array()
        .and_then(|rows| rows.iter().map(Value::as_array).collect());
    let Some(rows) = rows.filter(|rows| !rows.is_empty()) else {
        block.mistaken(member, &what);
        return None;
    };
    let pointer = block.pointer_to(member);
    let faults = block.faults();
    let width = rows[0].len();
    if let Some(j) = rows.iter().position(|row| row.len() != width) {
        faults.add(
            join(&pointer, j),
            format!(
                "a row of {} given after rows of {width}; all rows need the same length, one value per x_mm ({order})",
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
                "{} rows of {width} values given; {order}, so {ny} rows of {nx} values are needed{swapped}",
                rows.len()
            ),
        );
        return None;
    }
    let mut refused = 0;
    let read: Vec<Option<Vec<f64>>> = rows
        .iter()
        .enumerate()
        .map(|(j, row)| numbers(row, &join(&pointer, j), allowed, &mut refused, faults))
        .collect();
    count_rest(&pointer, allowed, refused, faults);
    read.into_iter().collect()
}
