//! Curves through samples: cubics with slopes at the nodes chosen by different rules, polynomials through points (Lagrange), and natural cubic splines, smoothed on
//! request.
//!
//! The spline f of the samples `(s_i, d_i)` minimises `Σ w_i (d_i − f(s_i))² + λ ∫ (f'')² ds`, where `w_i` is half the distance between the neighbours of `s_i`, so that
//! `λ = (L/2π)⁴` halves waves of length L for any spacing. Source: Reinsch, "Smoothing by spline functions", Numerische Mathematik 10 (1967).

use crate::numerics::roots::interval;

/// A place on an axis, for the curves of many rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The node at the start of its interval.
    pub(crate) node: usize,
    /// Weights of the values at both ends of the interval.
    pub(crate) values: [f64; 2],
    /// Weights of the slopes at both ends of the interval.
    pub(crate) slopes: [f64; 2],
}

impl Place {
    /// A place on an ascending axis of at least 2 nodes; beyond the ends, relative to the outermost intervals.
    pub(crate) fn new(axis: &[f64], at: f64) -> Place {
        let node = interval(axis, at);
        let length = axis[node + 1] - axis[node];
        let share = (at - axis[node]) / length;
        let rest = 1.0 - share;
        let end = share * share * (3.0 - 2.0 * share);
        Place {
            node,
            values: [1.0 - end, end],
            slopes: [length * share * rest * rest, -length * share * share * rest],
        }
    }

    /// Value of the curve with given values and slopes at the nodes.
    pub(crate) fn value(&self, values: &[f64], slopes: &[f64]) -> f64 {
        let [start, end] = self.values;
        let [leaving, arriving] = self.slopes;
        let next = self.node + 1;
        start * values[self.node]
            + end * values[next]
            + (leaving * slopes[self.node] + arriving * slopes[next])
    }
}

/// Distance in nodes of the last value on which a slope of [`limited_slopes`] depends.
pub(crate) const SLOPE_REACH: usize = 2;

/// Slopes at the nodes of a curve through at least 2 values, limited where the values jump or have a kink.
///
/// A slope is that of the parabola through the node and its two neighbours, unless this parabola is curved more than a fixed number of times as strongly as those of both
/// neighbours. Then the slope is blended with the harmonic mean of the slopes of the adjoining chords, 0 if these differ in sign (the limiter of van Leer 1974), which
/// prevents the curve from overshooting the values. At the ends the parabola of the adjacent node is used. An inner slope depends on [`SLOPE_REACH`] values on either side.
pub(crate) fn limited_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let mut slopes = LimitedSlopes::new(axis);
    slopes.find(values);
    slopes.slopes
}

/// [`limited_slopes`] of successive curves over the same axis.
#[derive(Debug)]
pub(crate) struct LimitedSlopes {
    /// Inverse distance from every node to the next.
    per_width: Vec<f64>,
    /// Two over the distance between both neighbours, for every inner node.
    bend: Vec<f64>,
    /// Weights of the chords before and after every inner node in the slope of its parabola.
    weights: Vec<[f64; 2]>,
    rises: Vec<f64>,
    /// Second derivatives of the parabolas; those of the outermost nodes equal those of their neighbours.
    bends: Vec<f64>,
    /// Slopes of the last curve.
    pub(crate) slopes: Vec<f64>,
}

impl LimitedSlopes {
    /// Buffers for curves over an ascending axis of at least 2 nodes.
    pub(crate) fn new(axis: &[f64]) -> LimitedSlopes {
        let around = || {
            axis.windows(3)
                .map(|at| ([at[2] - at[1], at[1] - at[0]], at[2] - at[0]))
        };
        LimitedSlopes {
            per_width: axis.windows(2).map(|at| 1.0 / (at[1] - at[0])).collect(),
            bend: around().map(|(_, both)| 2.0 / both).collect(),
            weights: around()
                .map(|(parts, both)| parts.map(|part| part / both))
                .collect(),
            rises: Vec::with_capacity(axis.len()),
            bends: Vec::with_capacity(axis.len()),
            slopes: Vec::with_capacity(axis.len()),
        }
    }

    /// Computes the slopes of a curve.
    pub(crate) fn find(&mut self, values: &[f64]) {
        let n = values.len();
        self.rises.clear();
        let chords = values.windows(2).zip(&self.per_width);
        self.rises
            .extend(chords.map(|(ends, per_width)| (ends[1] - ends[0]) * per_width));
        self.slopes.clear();
        if n == 2 {
            self.slopes.resize(n, self.rises[0]);
            return;
        }
        let pairs = || self.rises.windows(2);
        self.bends.clear();
        self.bends.push(0.0);
        let bends = pairs().zip(&self.bend);
        self.bends
            .extend(bends.map(|(rise, per)| (rise[1] - rise[0]) * per));
        self.bends.push(self.bends[n - 2]);
        self.bends[0] = self.bends[1];
        self.slopes.push(0.0);
        let parabolas = pairs().zip(&self.weights);
        self.slopes
            .extend(parabolas.map(|(rise, [before, after])| before * rise[0] + after * rise[1]));
        for k in 1..n - 1 {
            let trust = self.trust(k);
            if trust < 1.0 {
                let (before, after) = (self.rises[k - 1], self.rises[k]);
                let steepness = before.abs() + after.abs();
                let mean = (before * after.abs() + after * before.abs()) / steepness;
                self.slopes[k] = trust * self.slopes[k] + (1.0 - trust) * mean;
            }
        }
        let end = |node: usize, chord: usize| {
            0.5 * self.trust(node) * self.bends[node] / self.per_width[chord]
        };
        let (first, last) = (end(1, 0), end(n - 2, n - 2));
        self.slopes[0] = self.rises[0] - first;
        self.slopes.push(self.rises[n - 2] + last);
    }

    /// Share of the parabola in the slope at an inner node.
    fn trust(&self, k: usize) -> f64 {
        /// Largest ratio of the curvature of a parabola to those of its neighbours. Chosen by judgement.
        const SLOPE_LIMIT: f64 = 8.0;
        let bend = self.bends[k].abs();
        let allowed = SLOPE_LIMIT * self.bends[k - 1].abs().min(self.bends[k + 1].abs());
        if bend <= allowed { 1.0 } else { allowed / bend }
    }
}

/// Slopes that favour the straighter side, so that the curve stays close to the chords where a spline overshoots (H. Akima, Journal of the ACM 17, 1970). The axis has at
/// least 2 nodes and increases.
pub(crate) fn akima_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let count = axis.len();
    // Slopes of the chords, with two more at either end by linear continuation.
    let mut chords = vec![0.0; count + 3];
    for k in 0..count - 1 {
        chords[k + 2] = (values[k + 1] - values[k]) / (axis[k + 1] - axis[k]);
    }
    for k in [1, 0] {
        chords[k] = 2.0 * chords[k + 1] - chords[k + 2];
    }
    for k in [count + 1, count + 2] {
        chords[k] = 2.0 * chords[k - 1] - chords[k - 2];
    }
    (0..count)
        .map(|k| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|j| chords[k + j]);
            let (before, after) = ((b - a).abs(), (d - c).abs());
            if before + after > 0.0 {
                (after * b + before * c) / (before + after)
            } else {
                0.5 * (b + c)
            }
        })
        .collect()
}

/// Weight of the value at a node in the value at `at` of the polynomial through the nodes. No two nodes are equal.
pub(crate) fn polynomial_weight(nodes: &[f64], node: usize, at: f64) -> f64 {
    let others = (0..nodes.len()).filter(|other| *other != node);
    let parts = others.map(|other| (at - nodes[other]) / (nodes[node] - nodes[other]));
    parts.product()
}

/// The weights of all nodes; see [`polynomial_weight`].
pub(crate) fn polynomial_weights<const N: usize>(nodes: &[f64; N], at: f64) -> [f64; N] {
    std::array::from_fn(|node| polynomial_weight(nodes, node, at))
}

/// Value at `at` of the polynomial of least degree through at least one point `(place, value)`.
pub fn polynomial_value(points: &[(f64, f64)], at: f64) -> f64 {
    let nodes: Vec<f64> = points.iter().map(|(node, _)| *node).collect();
    let weighted = |(i, (_, value)): (usize, &(f64, f64))| polynomial_weight(&nodes, i, at) * value;
    points.iter().enumerate().map(weighted).sum()
}

/// A natural cubic spline; linear beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    knots: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the knots, 0 at both ends.
    bends: Vec<f64>,
}

impl Spline {
    /// The splines through two series of `values` at at least 2 strictly increasing `knots`. Waves shorter than about `cut_wavelength` (same unit as the knots) are smoothed
    /// away; 0 means interpolation. Smoothed splines pass exactly through the first and the last value where `ends` is set.
    pub fn pair(
        knots: &[f64],
        values: [Vec<f64>; 2],
        cut_wavelength: f64,
        ends: [bool; 2],
    ) -> [Spline; 2] {
        let n = knots.len();
        let lambda = (cut_wavelength / std::f64::consts::TAU).powi(4);
        let mut splines = values.map(|values| Spline {
            knots: knots.to_vec(),
            values,
            bends: vec![0.0; n],
        });
        if n < 3 {
            return splines;
        }
        let step: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let stiffness = |i: usize| {
            if i == 0 && ends[0] || i == n - 1 && ends[1] {
                return 0.0;
            }
            let before = if i > 0 { step[i - 1] } else { 0.0 };
            let after = if i < n - 1 { step[i] } else { 0.0 };
            2.0 * lambda / (before + after)
        };
        let stiffness: Vec<f64> = (0..n).map(stiffness).collect();
        // Column i of the second differences has three entries, at the knots i, i + 1 and i + 2.
        let columns: Vec<[f64; 3]> = (step.windows(2))
            .map(|pair| (1.0 / pair[0], 1.0 / pair[1]))
            .map(|(a, b)| [a, -a - b, b])
            .collect();
        let mut bands = vec![[0.0; 3]; n - 2];
        for (i, band) in bands.iter_mut().enumerate() {
            let own = columns[i];
            band[0] = (step[i] + step[i + 1]) / 3.0;
            band[0] += (0..3)
                .map(|j| own[j] * own[j] * stiffness[i + j])
                .sum::<f64>();
            if let Some(next) = columns.get(i + 1) {
                band[1] = step[i + 1] / 6.0
                    + own[1] * next[0] * stiffness[i + 1]
                    + own[2] * next[1] * stiffness[i + 2];
            }
            if let Some(next) = columns.get(i + 2) {
                band[2] = own[2] * next[0] * stiffness[i + 2];
            }
        }
        let rise =
            |spline: &Spline, i: usize| (0..3).map(|j| columns[i][j] * spline.values[i + j]).sum();
        let mut right: Vec<[f64; 2]> = (0..n - 2)
            .map(|i| [rise(&splines[0], i), rise(&splines[1], i)])
            .collect();
        solve(&mut bands, &mut right);
        for (k, spline) in splines.iter_mut().enumerate() {
            for (i, right) in right.iter().enumerate() {
                spline.bends[i + 1] = right[k];
                if lambda > 0.0 {
                    for (j, entry) in columns[i].into_iter().enumerate() {
                        spline.values[i + j] -= stiffness[i + j] * entry * right[k];
                    }
                }
            }
        }
        splines
    }

    /// The knots.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Coefficients of the cubic between the knots i and i + 1 in powers of the distance from knot i.
    pub fn cubic(&self, i: usize) -> [f64; 4] {
        let step = self.knots[i + 1] - self.knots[i];
        let [first, last] = [self.bends[i], self.bends[i + 1]];
        let rise = (self.values[i + 1] - self.values[i]) / step;
        let slope = rise - (2.0 * first + last) * step / 6.0;
        [
            self.values[i],
            slope,
            0.5 * first,
            (last - first) / (6.0 * step),
        ]
    }
}

/// Solves a symmetric positive definite system with two side bands for two right-hand sides by LDLᵀ; `bands[i]` holds the entries `(i, i)`,
/// `(i, i + 1)`, `(i, i + 2)`. The solutions replace the right-hand sides.
fn solve(bands: &mut [[f64; 3]], right: &mut [[f64; 2]]) {
    let n = right.len();
    for i in 0..n {
        let [pivot, near, far] = bands[i];
        let own = right[i];
        if i + 1 < n {
            bands[i + 1][0] -= near * near / pivot;
            bands[i + 1][1] -= near * far / pivot;
            let share = near / pivot;
            (0..2).for_each(|k| right[i + 1][k] -= share * own[k]);
        }
        if i + 2 < n {
            bands[i + 2][0] -= far * far / pivot;
            let share = far / pivot;
            (0..2).for_each(|k| right[i + 2][k] -= share * own[k]);
        }
    }
    for i in (0..n).rev() {
        let [pivot, near, far] = bands[i];
        let after = |by: usize, k: usize| right.get(i + by).map_or(0.0, |right| right[k]);
        let known = [0, 1].map(|k| near * after(1, k) + far * after(2, k));
        right[i] = [0, 1].map(|k| (right[i][k] - known[k]) / pivot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn akima_leaves_a_line_straight_up_to_where_it_bends() {
        let axis: Vec<f64> = (0..10).map(f64::from).collect();
        let values = axis.clone().into_iter().map(|x| (x - 5.0).max(0.0));
        let values: Vec<f64> = values.collect();
        let slopes = akima_slopes(&axis, &values);
        for (k, slope) in slopes.iter().enumerate() {
            let expected = [0.0, 1.0][usize::from(k > 5)];
            assert!(k == 5 || (slope - expected).abs() < 1e-12, "{slopes:?}");
        }
        for k in [0.3, 2.5, 3.9] {
            assert!(Place::new(&axis, k).value(&values, &slopes).abs() < 1e-12);
        }
    }

    #[test]
    fn limited_slopes_are_those_of_parabolas_unless_the_values_jump() {
        let axis = [0.0, 1.0, 1.5, 3.0, 5.0, 6.0];
        let parabola = limited_slopes(&axis, &axis.map(|x| 1.0 + x * (0.5 - x)));
        for (x, slope) in axis.iter().zip(parabola) {
            assert!((slope - (0.5 - 2.0 * x)).abs() < 1e-12);
        }
        let step = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let axis: Vec<f64> = (0..6).map(f64::from).collect();
        let slopes = limited_slopes(&axis, &step);
        for k in 0..50 {
            let found = Place::new(&axis, 0.1 * f64::from(k)).value(&step, &slopes);
            assert!((-0.1..1.1).contains(&found), "{found}");
        }
    }
}

#[cfg(test)]
mod lagrange_tests {
    use super::*;

    #[test]
    fn a_polynomial_of_as_many_terms_as_points_is_met_everywhere() {
        let cubic = |x: f64| 1.0 + x * (2.0 - x * (0.5 + 3.0 * x));
        let nodes = [-1.0, 0.2, 0.7, 2.0];
        let points = nodes.map(|x| (x, cubic(x)));
        for at in [-2.0, -1.0, 0.0, 0.65, 3.0] {
            let weighted = polynomial_weights(&nodes, at).into_iter().zip(points);
            let by_weights: f64 = weighted.map(|(weight, (_, value))| weight * value).sum();
            assert!((by_weights - cubic(at)).abs() < 1e-12 * cubic(at).abs().max(1.0));
            assert!(
                (polynomial_value(&points, at) - by_weights).abs()
                    < 1e-12 * cubic(at).abs().max(1.0)
            );
        }
        assert_eq!(polynomial_value(&points[..1], 7.0), points[0].1);
    }
}

#[cfg(test)]
mod spline_tests {
    use super::*;

    fn sampled(step: f64, f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let knots: Vec<f64> = (0..=400).map(|k| f64::from(k) * step).collect();
        let values = knots.iter().map(|s| f(*s)).collect();
        (knots, values)
    }

    fn splined(knots: &[f64], values: &[f64], cut_wavelength: f64, ends: [bool; 2]) -> Spline {
        let both = [values.to_vec(), vec![0.0; values.len()]];
        let [spline, _] = Spline::pair(knots, both, cut_wavelength, ends);
        spline
    }

    /// Value, slope and second derivative at a place between the knots.
    fn at(spline: &Spline, s: f64) -> [f64; 3] {
        let i = interval(&spline.knots, s);
        let d = s - spline.knots[i];
        let [c0, c1, c2, c3] = spline.cubic(i);
        [
            c0 + d * (c1 + d * (c2 + d * c3)),
            c1 + d * (2.0 * c2 + 3.0 * d * c3),
            2.0 * c2 + 6.0 * d * c3,
        ]
    }

    #[test]
    fn interpolation_meets_its_samples_and_is_of_fourth_order_inside() {
        let mut errors = Vec::new();
        for step in [0.02, 0.01] {
            let (knots, values) = sampled(step, f64::sin);
            let spline = splined(&knots, &values, 0.0, [false; 2]);
            for (s, value) in knots.iter().zip(&values) {
                assert!((at(&spline, *s)[0] - value).abs() < 1e-14);
            }
            let middle = 2.0 + 0.5 * step;
            let [value, slope, bend] = at(&spline, middle);
            errors.push((value - middle.sin()).abs());
            assert!((slope - middle.cos()).abs() < 1e-6);
            assert!((bend + middle.sin()).abs() < 1e-3);
        }
        assert!(errors[0] / errors[1] > 12.0, "{errors:?}");
    }

    #[test]
    fn a_wave_of_the_cut_length_is_halved_and_longer_ones_pass() {
        for (step, shift) in [(0.05, 0.0), (0.025, 0.0), (0.05, 0.02)] {
            for (length, kept) in [(2.0, 0.5), (4.0, 16.0 / 17.0), (1.0, 1.0 / 17.0)] {
                let wave = |s: f64| (std::f64::consts::TAU * s / length).cos();
                let (mut knots, _) = sampled(step, wave);
                for knot in knots.iter_mut().skip(1).step_by(2) {
                    *knot += shift;
                }
                let values: Vec<f64> = knots.iter().map(|s| wave(*s)).collect();
                let spline = splined(&knots, &values, 2.0, [false; 2]);
                let found = at(&spline, 4.0)[0];
                assert!(
                    (found - kept).abs() < 0.02,
                    "{step} {length}: {found} against {kept}"
                );
            }
        }
    }

    #[test]
    fn a_pinned_end_stays_where_its_sample_is() {
        let (knots, values) = sampled(0.1, |s| (3.0 * s).sin() + 0.1 * (40.0 * s).cos());
        let last = knots.len() - 1;
        let spline = splined(&knots, &values, 3.0, [true, false]);
        assert!((at(&spline, 0.0)[0] - values[0]).abs() < 1e-12);
        assert!((at(&spline, knots[last])[0] - values[last]).abs() > 1e-3);
        let free = splined(&knots, &values, 3.0, [false; 2]);
        assert!((at(&free, 0.0)[0] - values[0]).abs() > 1e-3);
        // Far from the ends both are the same.
        assert!((at(&free, 20.0)[0] - at(&spline, 20.0)[0]).abs() < 1e-9);
    }

    #[test]
    fn lines_are_kept_by_any_smoothing() {
        let (knots, values) = sampled(0.1, |s| 3.0 - 0.5 * s);
        let spline = splined(&knots, &values, 50.0, [false; 2]);
        for s in [0.0, 3.33, 40.0] {
            assert!((at(&spline, s)[0] - (3.0 - 0.5 * s)).abs() < 1e-9);
        }
    }
}
