//! The spline through the values at the nodes of the table, and its file.

use faer::Mat;
use faer::linalg::solvers::Solve;
use railhead_contact::rolling::methods::table::evaluate::CreepTable;
use railhead_contact::rolling::methods::table::spline::{
    Axis, DIRECTION_COEFFICIENTS, DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLE_COEFFICIENTS, POLES,
    RATIOS, ROW, SIZES,
};
use serde_json::Value;

use Mirror::{Even, Odd};

/// Number of values at all nodes.
pub const VALUES: usize = RATIOS * POLES * DIRECTIONS * ROW;

/// The continuation of the functions beyond χ = ±π/2, where the creepage along rolling changes sign.
const ACROSS_ROLLING: [Mirror; OUTPUTS] = [Odd, Even, Even, Even];

/// The continuation of the part of a function that is even in χ beyond θ = 0 (the spin changes sign) and θ = π/2 (both creepages do). The part that is odd in χ
/// continues with the opposite sign.
///
/// The forces satisfy `F_x(x, y, −z) = F_x(x, −y, z)` and `F_x(−x, −y, z) = −F_x(x, −y, z)`. Lateral force and moment have the opposite sign in the first
/// relation and not in the second, the share that sticks in neither.
const OF_SPIN: [[Mirror; 2]; OUTPUTS] = [[Even, Odd], [Odd, Even], [Odd, Even], [Even, Even]];

/// Coefficients `[a/b][pole][direction][size][ν][function]` of the spline through values `[a/b][pole][direction][size][ν][function]`.
fn coefficients(values: &[f32]) -> Vec<f32> {
    let along = |matrix: &[Vec<f64>], before: usize, from: &[f32], inner: usize| {
        transformed(matrix, before, from, inner)
    };
    let sizes = along(
        &free_coefficients(&SIZES),
        RATIOS * POLES * DIRECTIONS,
        values,
        POISSON_RATIOS.len() * OUTPUTS,
    );
    let ratio_places: [u8; RATIOS] = std::array::from_fn(|k| k as u8);
    let ratios = along(
        &free_coefficients(&ratio_places),
        1,
        &sizes,
        POLES * DIRECTIONS * ROW,
    );
    let poles = over_poles(&ratios);
    over_directions(&poles)
}

/// Applies a matrix to one index of an array `[before][nodes][inner]`.
fn transformed(matrix: &[Vec<f64>], before: usize, from: &[f32], inner: usize) -> Vec<f32> {
    let nodes = matrix[0].len();
    let mut to = vec![0.0; before * matrix.len() * inner];
    let blocks = from.chunks_exact(nodes * inner);
    for (from, to) in blocks.zip(to.chunks_exact_mut(matrix.len() * inner)) {
        for (row, to) in matrix.iter().zip(to.chunks_exact_mut(inner)) {
            for (weight, from) in row.iter().zip(from.chunks_exact(inner)) {
                let weight = *weight as f32;
                to.iter_mut()
                    .zip(from)
                    .for_each(|(to, from)| *to += weight * from);
            }
        }
    }
    to
}

/// Adds the rows of an array, multiplied by the weight of each function.
fn add(to: &mut [f32], from: &[f32], weights: [f32; OUTPUTS]) {
    let (to, _) = to.as_chunks_mut::<OUTPUTS>();
    let (from, _) = from.as_chunks::<OUTPUTS>();
    for (to, from) in to.iter_mut().zip(from) {
        for k in 0..OUTPUTS {
            to[k] += weights[k] * from[k];
        }
    }
}

/// Splines over the poles of an array `[a/b][pole][direction][row]`, separately for the parts even and odd in the direction.
fn over_poles(from: &[f32]) -> Vec<f32> {
    let of_ends = |ends: [Mirror; 2]| mirrored_coefficients(POLES, ends);
    let matrices = OF_SPIN.map(|ends| [of_ends(ends), of_ends(ends.map(Mirror::other))]);
    let block = DIRECTIONS * ROW;
    let mut to = vec![0.0; RATIOS * POLE_COEFFICIENTS * block];
    let blocks = from.chunks_exact(POLES * block);
    for (from, to) in blocks.zip(to.chunks_exact_mut(POLE_COEFFICIENTS * block)) {
        for (pole, to) in to.chunks_exact_mut(block).enumerate() {
            for (node, from) in from.chunks_exact(block).enumerate() {
                // Half the sum and half the difference of the two weights apply to χ and −χ.
                let half = |sign: f64| -> [f32; OUTPUTS] {
                    std::array::from_fn(|k| {
                        let [same, other] = &matrices[k];
                        0.5 * (same[pole][node] + sign * other[pole][node]) as f32
                    })
                };
                let (here, mirrored) = (half(1.0), half(-1.0));
                for chi in 0..DIRECTIONS {
                    let to = &mut to[chi * ROW..(chi + 1) * ROW];
                    add(to, &from[chi * ROW..(chi + 1) * ROW], here);
                    let image = DIRECTIONS - 1 - chi;
                    add(to, &from[image * ROW..(image + 1) * ROW], mirrored);
                }
            }
        }
    }
    to
}

/// Splines over the directions of an array `[a/b][pole][direction][row]`.
fn over_directions(from: &[f32]) -> Vec<f32> {
    let matrices = ACROSS_ROLLING.map(|end| mirrored_coefficients(DIRECTIONS, [end; 2]));
    let mut to = vec![0.0; from.len() / DIRECTIONS * DIRECTION_COEFFICIENTS];
    let blocks = from.chunks_exact(DIRECTIONS * ROW);
    for (from, to) in blocks.zip(to.chunks_exact_mut(DIRECTION_COEFFICIENTS * ROW)) {
        for (chi, to) in to.chunks_exact_mut(ROW).enumerate() {
            for (node, from) in from.chunks_exact(ROW).enumerate() {
                let weights: [f32; OUTPUTS] =
                    std::array::from_fn(|k| matrices[k][chi][node] as f32);
                add(to, from, weights);
            }
        }
    }
    to
}

/// The continuation of a function beyond an end of an axis as its own mirror image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mirror {
    /// Equal values.
    Even,
    /// Opposite values; 0 at the end.
    Odd,
}

impl Mirror {
    /// The opposite continuation.
    fn other(self) -> Mirror {
        match self {
            Even => Odd,
            Odd => Even,
        }
    }
}

/// The matrix from values at uniform nodes to the coefficients of [`Axis::mirrored`], row by row.
fn mirrored_coefficients(nodes: usize, ends: [Mirror; 2]) -> Vec<Vec<f64>> {
    let mut system = vec![vec![0.0; nodes]; nodes];
    for (node, row) in system.iter_mut().enumerate() {
        for (other, weight) in [(-1, 1.0), (0, 4.0), (1, 1.0)] {
            let (column, sign) = reflected(node as isize + other, nodes, ends);
            row[column] += sign * weight / 6.0;
        }
    }
    let inside = inverse(&system);
    let mut all = Vec::with_capacity(nodes + 2);
    for row in -1..=nodes as isize {
        let (inner, sign) = reflected(row, nodes, ends);
        all.push(inside[inner].iter().map(|v| sign * v).collect());
    }
    all
}

/// The matrix from values at the nodes of [`Axis::free`] to coefficients.
fn free_coefficients(places: &[u8]) -> Vec<Vec<f64>> {
    let axis = Axis::free(0.0, 1.0, places);
    let mut system = vec![vec![0.0; places.len()]; places.len()];
    for (row, place) in system.iter_mut().zip(places) {
        let weights = axis.at(f64::from(*place));
        for (k, weight) in weights.weights.iter().enumerate() {
            row[weights.first + k] = *weight;
        }
    }
    inverse(&system)
}

/// The node whose value replaces one beyond the ends, and its sign.
fn reflected(node: isize, nodes: usize, ends: [Mirror; 2]) -> (usize, f64) {
    let last = nodes as isize - 1;
    let sign = |mirror| if mirror == Odd { -1.0 } else { 1.0 };
    if node < 0 {
        ((-node) as usize, sign(ends[0]))
    } else if node > last {
        ((2 * last - node) as usize, sign(ends[1]))
    } else {
        (node as usize, 1.0)
    }
}

/// Returns the inverse of a small square matrix, both row by row.
fn inverse(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = rows.len();
    let matrix = Mat::from_fn(n, n, |i, j| rows[i][j]);
    let unit = matrix.partial_piv_lu().solve(Mat::<f64>::identity(n, n));
    (0..n)
        .map(|i| (0..n).map(|j| unit[(i, j)]).collect())
        .collect()
}

/// Returns the coefficients of the spline through values at the nodes as whole numbers, and the unit of each function.
fn whole(values: &[f32]) -> (Vec<i16>, [f32; OUTPUTS]) {
    let exact = coefficients(values);
    let mut unit = [f32::MIN_POSITIVE; OUTPUTS];
    for (k, value) in exact.iter().enumerate() {
        let unit = &mut unit[k % OUTPUTS];
        *unit = unit.max(value.abs() / f32::from(i16::MAX));
    }
    let number = |(k, value): (usize, &f32)| (value / unit[k % OUTPUTS]).round() as i16;
    (exact.iter().enumerate().map(number).collect(), unit)
}

/// Returns the table with these values at its nodes and bounds of the cells between them.
pub fn table(values: &[f32], bounds: &[f32]) -> CreepTable {
    let (spline, unit) = whole(values);
    CreepTable::new(spline, unit, bounds.to_vec())
}

/// Returns the bytes of the file of such a table; `about` describes how the values were computed.
pub fn file(about: &Value, values: &[f32], bounds: &[f32]) -> Vec<u8> {
    let (spline, unit) = whole(values);
    let largest = bounds.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let bound_unit = largest / f32::from(u8::MAX);
    let mut bytes = about.to_string().into_bytes();
    bytes.push(b'\n');
    bytes.extend(
        unit.into_iter()
            .chain([bound_unit])
            .flat_map(f32::to_le_bytes),
    );
    bytes.extend(spline.into_iter().flat_map(i16::to_le_bytes));
    // No bound is rounded down.
    let whole = |bound: &f32| (bound / bound_unit).ceil().min(255.0) as u8;
    bytes.extend(bounds.iter().map(whole));
    bytes
}
