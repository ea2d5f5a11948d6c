//! Cubic splines along one axis of the table: from values at nodes to coefficients, and the weights of coefficients at a point.

use std::ops::Range;

use crate::contact::numerics::dense_lu::inverse;

/// Cubic pieces: how the four coefficients from a first one on weigh in each bin, by powers of the place in the bin.
#[derive(Debug, Clone)]
pub struct Axis {
    low: f64,
    bins_per_unit: f64,
    /// The first coefficient of each bin.
    first: Vec<usize>,
    /// In each bin the polynomials of four coefficients.
    pieces: Vec<[[f64; 4]; 4]>,
}

/// The coefficients at a point: the first of four, their weights, and the derivatives of these by the place on the axis.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// The first of four coefficients.
    pub first: usize,
    /// Weights of values.
    pub value: [f64; 4],
    /// Weights of derivatives.
    pub slope: [f64; 4],
}

/// What values become behind an end of an axis where the table continues as its own mirror image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirror {
    /// The same.
    Even,
    /// Turned around; 0 at the end itself.
    Odd,
}

impl Mirror {
    /// The other way.
    #[must_use]
    pub fn other(self) -> Mirror {
        match self {
            Mirror::Even => Mirror::Odd,
            Mirror::Odd => Mirror::Even,
        }
    }
}

impl Axis {
    /// An axis of `nodes` uniform nodes that has one more coefficient before the first node and one behind the last.
    #[must_use]
    pub fn mirrored(ends: Range<f64>, nodes: usize) -> Axis {
        let piece = [
            [1.0, -3.0, 3.0, -1.0],
            [4.0, 0.0, -6.0, 3.0],
            [1.0, 3.0, 3.0, -3.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
        .map(|weights| weights.map(|w| w / 6.0));
        Axis {
            low: ends.start,
            bins_per_unit: (nodes - 1) as f64 / (ends.end - ends.start),
            first: (0..nodes - 1).collect(),
            pieces: vec![piece; nodes - 1],
        }
    }

    /// An axis with nodes at whole steps from `places[0] = 0` to the last, `step` wide, whose second and last but one are no knots: as
    /// many coefficients as nodes.
    #[must_use]
    pub fn free(low: f64, step: f64, places: &[u8]) -> Axis {
        let knots = knots(places);
        let bins = usize::from(places[places.len() - 1]);
        let mut axis = Axis {
            low,
            bins_per_unit: 1.0 / step,
            first: Vec::new(),
            pieces: Vec::new(),
        };
        for bin in 0..bins {
            let start = bin as f64;
            let first = knots[4..knots.len() - 4].partition_point(|knot| *knot <= start);
            let samples = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
            let piece = std::array::from_fn(|k| {
                cubic_through(samples.map(|s| basis(&knots, first + k, first + 3, start + s)))
            });
            axis.first.push(first);
            axis.pieces.push(piece);
        }
        axis
    }

    /// The weights at a place; beyond the ends those of the end.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, place: f64) -> Weights {
        let last = self.first.len() - 1;
        let along = ((place - self.low) * self.bins_per_unit).clamp(0.0, (last + 1) as f64);
        let bin = (along as usize).min(last);
        let t = along - bin as f64;
        let piece = &self.pieces[bin];
        let value = |p: &[f64; 4]| p[0] + t * (p[1] + t * (p[2] + t * p[3]));
        let slope = |p: &[f64; 4]| self.bins_per_unit * (p[1] + t * (2.0 * p[2] + t * 3.0 * p[3]));
        Weights {
            first: self.first[bin],
            value: [
                value(&piece[0]),
                value(&piece[1]),
                value(&piece[2]),
                value(&piece[3]),
            ],
            slope: [
                slope(&piece[0]),
                slope(&piece[1]),
                slope(&piece[2]),
                slope(&piece[3]),
            ],
        }
    }
}

/// The matrix from values at uniform nodes to their coefficients and one more at each end, row by row.
#[must_use]
pub fn mirrored_coefficients(nodes: usize, ends: [Mirror; 2]) -> Vec<Vec<f64>> {
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
#[must_use]
pub fn free_coefficients(places: &[u8]) -> Vec<Vec<f64>> {
    let axis = Axis::free(0.0, 1.0, places);
    let mut system = vec![vec![0.0; places.len()]; places.len()];
    for (row, place) in system.iter_mut().zip(places) {
        let weights = axis.at(f64::from(*place));
        for (k, weight) in weights.value.iter().enumerate() {
            row[weights.first + k] = *weight;
        }
    }
    inverse(&system)
}

/// The node that stands for one beyond the ends, and its sign.
fn reflected(node: isize, nodes: usize, ends: [Mirror; 2]) -> (usize, f64) {
    let last = nodes as isize - 1;
    let sign = |mirror| if mirror == Mirror::Odd { -1.0 } else { 1.0 };
    if node < 0 {
        ((-node) as usize, sign(ends[0]))
    } else if node > last {
        ((2 * last - node) as usize, sign(ends[1]))
    } else {
        (node as usize, 1.0)
    }
}

/// Knots of a cubic spline through the places, the second and the last but one left out.
fn knots(places: &[u8]) -> Vec<f64> {
    let at = |k: usize| f64::from(places[k]);
    let last = places.len() - 1;
    let inner = (2..last - 1).map(at);
    [at(0); 4]
        .into_iter()
        .chain(inner)
        .chain([at(last); 4])
        .collect()
}

/// The `k`-th cubic B-spline at `x`, by the piece between knots `interval` and the next (de Boor 1978).
fn basis(knots: &[f64], k: usize, interval: usize, x: f64) -> f64 {
    fn part(knots: &[f64], k: usize, degree: usize, interval: usize, x: f64) -> f64 {
        if degree == 0 {
            return if k == interval { 1.0 } else { 0.0 };
        }
        let share = |from: f64, to: f64, rise: f64, below: f64| {
            if to > from {
                rise / (to - from) * below
            } else {
                0.0
            }
        };
        let (left, right) = (knots[k], knots[k + degree + 1]);
        share(
            left,
            knots[k + degree],
            x - left,
            part(knots, k, degree - 1, interval, x),
        ) + share(
            knots[k + 1],
            right,
            right - x,
            part(knots, k + 1, degree - 1, interval, x),
        )
    }
    part(knots, k, 3, interval, x)
}

/// The cubic with these values at 0, 1/3, 2/3 and 1, by powers.
fn cubic_through(v: [f64; 4]) -> [f64; 4] {
    let [a, b, c, d] = v;
    [
        a,
        -5.5 * a + 9.0 * b - 4.5 * c + d,
        9.0 * a - 22.5 * b + 18.0 * c - 4.5 * d,
        -4.5 * a + 13.5 * b - 13.5 * c + 4.5 * d,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn value(axis: &Axis, coefficients: &[f64], at: f64) -> [f64; 2] {
        let weights = axis.at(at);
        let sum = |w: [f64; 4]| (0..4).map(|k| w[k] * coefficients[weights.first + k]).sum();
        [sum(weights.value), sum(weights.slope)]
    }

    fn times(matrix: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
        let row = |row: &Vec<f64>| row.iter().zip(values).map(|(m, v)| m * v).sum();
        matrix.iter().map(row).collect()
    }

    #[test]
    fn cubics_are_met_everywhere_on_uneven_nodes() {
        let places = [0, 2, 4, 6, 8, 10, 11, 12, 13, 14, 16, 20, 24];
        let cubic = |x: f64| {
            [
                0.3 - x + 0.2 * x * x - 0.01 * x * x * x,
                -1.0 + 0.4 * x - 0.03 * x * x,
            ]
        };
        let axis = Axis::free(0.0, 1.0, &places);
        let nodes = places.map(|p| cubic(f64::from(p))[0]);
        let coefficients = times(&free_coefficients(&places), &nodes);
        for k in 0..=240 {
            let x = 0.1 * f64::from(k);
            let [v, s] = value(&axis, &coefficients, x);
            assert!((v - cubic(x)[0]).abs() < 1e-10, "{x}: {v}");
            assert!((s - cubic(x)[1]).abs() < 1e-10, "{x}: {s}");
        }
    }

    #[test]
    fn waves_that_mirror_at_the_ends_are_met_to_the_fourth_order_with_slopes_that_end_at_0() {
        let axis = Axis::mirrored(0.0..PI, 17);
        for (ends, wave) in [
            ([Mirror::Even, Mirror::Even], f64::cos as fn(f64) -> f64),
            ([Mirror::Odd, Mirror::Odd], f64::sin),
        ] {
            let nodes: Vec<f64> = (0..17).map(|k| wave(PI * f64::from(k) / 16.0)).collect();
            let coefficients = times(&mirrored_coefficients(17, ends), &nodes);
            for k in 0..=100 {
                let x = PI * f64::from(k) / 100.0;
                assert!((value(&axis, &coefficients, x)[0] - wave(x)).abs() < 2e-5);
            }
            let at_end = value(&axis, &coefficients, 0.0);
            let zero = if ends[0] == Mirror::Even {
                at_end[1]
            } else {
                at_end[0]
            };
            assert!(zero.abs() < 1e-14, "{zero}");
        }
    }
}
