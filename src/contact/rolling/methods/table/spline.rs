//! From the values at the nodes of the table to the coefficients of its spline.

use crate::contact::rolling::methods::table::axis::Mirror::{Even, Odd};
use crate::contact::rolling::methods::table::axis::{
    Mirror, free_coefficients, mirrored_coefficients,
};
use crate::contact::rolling::methods::table::grid::{
    DIRECTIONS, POISSON_RATIOS, POLES, RATIOS, SIZES,
};

/// Functions in the table: F_x, F_y, M_z and the share that sticks.
pub const OUTPUTS: usize = 4;
/// Coefficients in the pole and in the direction: one more beyond each end.
pub const POLE_COEFFICIENTS: usize = POLES + 2;
/// The same in the direction.
pub const DIRECTION_COEFFICIENTS: usize = DIRECTIONS + 2;
/// Numbers of one a/b, pole and direction: sizes, Poisson's ratios, functions.
pub const ROW: usize = SIZES.len() * POISSON_RATIOS.len() * OUTPUTS;
/// Numbers of all coefficients.
pub const COEFFICIENTS: usize = RATIOS * POLE_COEFFICIENTS * DIRECTION_COEFFICIENTS * ROW;
/// Values at all nodes.
pub const VALUES: usize = RATIOS * POLES * DIRECTIONS * ROW;

/// How a function continues beyond χ = ±π/2, where the creepage along rolling changes its sign.
const ACROSS_ROLLING: [Mirror; OUTPUTS] = [Odd, Even, Even, Even];

/// How the part of a function that is even in χ continues beyond θ = 0 (the spin changes its sign) and θ = π/2 (both creepages do); the
/// part that is odd in χ continues the other way.
///
/// Of a function f(x, y, z) there is `F_x(x, y, −z) = F_x(x, −y, z)` and `F_x(−x, −y, z) = −F_x(x, −y, z)`; lateral force and moment have
/// the other sign in the first and not in the second, the share that sticks in neither.
const OF_SPIN: [[Mirror; 2]; OUTPUTS] = [[Even, Odd], [Odd, Even], [Odd, Even], [Even, Even]];

/// Coefficients `[a/b][pole][direction][size][ν][function]` of the spline through values `[a/b][pole][direction][size][ν][function]`.
#[must_use]
pub fn coefficients(values: &[f32]) -> Vec<f32> {
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

/// A matrix applied to one index of an array `[before][nodes][inner]`.
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

/// Adds the rows of an array times the weight of each function.
fn add(to: &mut [f32], from: &[f32], weights: [f32; OUTPUTS]) {
    let (to, _) = to.as_chunks_mut::<OUTPUTS>();
    let (from, _) = from.as_chunks::<OUTPUTS>();
    for (to, from) in to.iter_mut().zip(from) {
        for k in 0..OUTPUTS {
            to[k] += weights[k] * from[k];
        }
    }
}

/// Splines over the poles of an array `[a/b][pole][direction][row]`: the parts even and odd in the direction by themselves.
fn over_poles(from: &[f32]) -> Vec<f32> {
    let of_ends = |ends: [Mirror; 2]| mirrored_coefficients(POLES, ends);
    let matrices = OF_SPIN.map(|ends| [of_ends(ends), of_ends(ends.map(Mirror::other))]);
    let block = DIRECTIONS * ROW;
    let mut to = vec![0.0; RATIOS * POLE_COEFFICIENTS * block];
    let blocks = from.chunks_exact(POLES * block);
    for (from, to) in blocks.zip(to.chunks_exact_mut(POLE_COEFFICIENTS * block)) {
        for (pole, to) in to.chunks_exact_mut(block).enumerate() {
            for (node, from) in from.chunks_exact(block).enumerate() {
                // Half the sum and half the difference of the two weights act on χ and on −χ.
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
    let mut to = vec![0.0; COEFFICIENTS];
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
