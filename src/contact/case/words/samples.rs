//! Reads axes of grids and the samples over one or two axes.

use serde_json::Value;

use crate::case::words::object::{AllowedRange, Object};

/// The allowed coordinates.
pub(crate) const COORDINATE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
/// Allowed number of points of a grid axis and of a table of friction coefficients.
pub(crate) const AXIS_POINTS: std::ops::RangeInclusive<usize> = 2..=1000;
/// Smallest spacing of an axis relative to its largest coordinate and to its length. Floating-point arithmetic does not resolve much smaller ones.
const SPACING_MIN: f64 = 1e-9;
/// Largest ratio of neighbouring spacings. More uneven samples do not show the edge of the contact.
const SPACING_RATIO_MAX: f64 = 1000.0;

/// Reads an axis of a grid: strictly increasing coordinates in mm.
pub(crate) fn axis(block: &mut Object, name: &str) -> Option<Vec<f64>> {
    let (low, high) = (AXIS_POINTS.start(), AXIS_POINTS.end());
    let what = format!("an array of {low} to {high} strictly increasing coordinates in mm");
    let axis = block.number_array(name, AXIS_POINTS, &what, COORDINATE)?;
    let (first, last) = (axis[0], axis[axis.len() - 1]);
    let largest = first.abs().max(last.abs());
    let least = SPACING_MIN * (last - first).abs().max(largest);
    let late = (1..axis.len()).find(|&i| axis[i] - axis[i - 1] <= least);
    if let Some(i) = late {
        let [before, given] = [axis[i - 1], axis[i]];
        let detail = format!(
            "{given} given after {before}; coordinates must increase strictly, each by more than {least:e} mm"
        );
        return block.refuse_element(name, i, detail);
    }
    let uneven = axis.windows(3).position(|at| {
        let (before, after) = (at[1] - at[0], at[2] - at[1]);
        before.max(after) > SPACING_RATIO_MAX * before.min(after)
    });
    if let Some(i) = uneven {
        let [first, second, given] = [axis[i], axis[i + 1], axis[i + 2]];
        let detail = format!(
            "{given} given after {first} and {second}; neighbouring spacings may differ by a factor of at most {SPACING_RATIO_MAX}"
        );
        return block.refuse_element(name, i + 2, detail);
    }
    Some(axis)
}

/// The allowed pressures.
const PRESSURE: AllowedRange = AllowedRange::closed(0.0, 1e12, "MPa");

/// Returns the length of an array, whose elements may be faulty.
fn length_of(block: &Object, name: &str) -> Option<usize> {
    block.value(name).and_then(Value::as_array).map(Vec::len)
}

/// Reads a gap for every `y_mm`.
pub(crate) fn gap_line(block: &mut Object, member: &str) -> Option<Vec<f64>> {
    let what = "an array with one gap per y_mm";
    block.required(member, what)?;
    let elements = block.array(member, 0..=usize::MAX, what)?;
    let (count, n) = (elements.len(), length_of(block, "y_mm"));
    if let Some(n) = n.filter(|n| *n != count) {
        let detail = format!("{count} values given; {what} is needed, which are {n}");
        return block.refuse(member, detail);
    }
    block.numbers(member, COORDINATE)
}

/// Reads a gap for every point of a grid.
pub(crate) fn gap_grid(block: &mut Object, member: &str) -> Option<Vec<Vec<f64>>> {
    grid(block, member, "gap", COORDINATE)
}

/// Reads a pressure for every point of a grid.
pub(crate) fn pressure_grid(block: &mut Object, member: &str) -> Option<Vec<Vec<f64>>> {
    grid(block, member, "pressure", PRESSURE)
}

/// Reads the samples of a grid over `x_mm` and `y_mm`. Faults call a sample `word`.
fn grid(
    block: &mut Object,
    member: &str,
    word: &str,
    allowed: AllowedRange,
) -> Option<Vec<Vec<f64>>> {
    let (nx, ny) = (length_of(block, "x_mm"), length_of(block, "y_mm"));
    let order = format!("{member}[j][i] belongs to (x_mm[i], y_mm[j])");
    let what = format!("an array of rows, one per y_mm, each with one {word} per x_mm ({order})");
    let value = block.required(member, &what)?;
    let rows: Option<Vec<&Vec<Value>>> = value
        .as_array()
        .and_then(|rows| rows.iter().map(Value::as_array).collect());
    let Some(rows) = rows.filter(|rows| !rows.is_empty()) else {
        return block.mistaken(member, &what);
    };
    let (height, width) = (rows.len(), rows[0].len());
    if let Some(j) = rows.iter().position(|row| row.len() != width) {
        let own = rows[j].len();
        let detail = format!(
            "a row of {own} given after rows of {width}; all rows need the same length, one value per x_mm ({order})"
        );
        return block.refuse_element(member, j, detail);
    }
    let (nx, ny) = (nx.unwrap_or(width), ny.unwrap_or(height));
    if (height, width) != (ny, nx) {
        let swapped = match (height, width) == (nx, ny) {
            true => "; the grid looks transposed",
            false => "",
        };
        let detail = format!(
            "{height} rows of {width} values given; {order}, so {ny} rows of {nx} values are needed{swapped}"
        );
        return block.refuse(member, detail);
    }
    let (mut grid, mut refused) = (block.elements(member)?, 0);
    let mut row = |j: usize| {
        let mut row = grid.elements(&j.to_string())?;
        row.own_numbers(allowed, &mut refused)
    };
    let read: Vec<Option<Vec<f64>>> = (0..height).map(&mut row).collect();
    grid.count_rest(refused, "values", format!("{allowed} is needed"));
    read.into_iter().collect()
}
