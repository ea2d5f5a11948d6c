//! Natural cubic splines through samples, smoothed on request.
//!
//! The spline f of the samples `(s_i, d_i)` minimises `Σ w_i (d_i − f(s_i))² + λ ∫ (f'')² ds`, with
//! `w_i` half the distance between the neighbours of `s_i`, so that `λ = (L/2π)⁴` halves waves of length L whatever the
//! spacing. Source: Reinsch, "Smoothing by spline functions", Numerische Mathematik 10 (1967).

/// A natural cubic spline; linear beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    knots: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the knots, 0 at both ends.
    bends: Vec<f64>,
}

/// Value and the first two derivatives at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineValue {
    /// Value.
    pub value: f64,
    /// First derivative.
    pub slope: f64,
    /// Second derivative.
    pub bend: f64,
}

impl Spline {
    /// The spline through `values` at strictly increasing `knots`, at least 2; waves shorter than about `cut_wavelength`
    /// (same unit as the knots) are smoothed away, 0 for interpolation.
    #[must_use]
    pub fn new(knots: &[f64], values: &[f64], cut_wavelength: f64) -> Spline {
        Spline::pinned(knots, values, cut_wavelength, [false; 2])
    }

    /// Like [`Spline::new`]. A smoothed spline passes exactly through the first and the last value where `ends` says so.
    #[must_use]
    pub fn pinned(knots: &[f64], values: &[f64], cut_wavelength: f64, ends: [bool; 2]) -> Spline {
        let n = knots.len();
        let lambda = (cut_wavelength / std::f64::consts::TAU).powi(4);
        let mut spline = Spline {
            knots: knots.to_vec(),
            values: values.to_vec(),
            bends: vec![0.0; n],
        };
        if n < 3 {
            return spline;
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
        // Column i of the second differences has three entries, at the knots i − 1, i and i + 1.
        let column = |i: usize| {
            let (a, b) = (1.0 / step[i - 1], 1.0 / step[i]);
            [a, -a - b, b]
        };
        let mut bands = vec![[0.0; 3]; n - 2];
        let mut right = vec![0.0; n - 2];
        for (k, band) in bands.iter_mut().enumerate() {
            let i = k + 1;
            let own = column(i);
            band[0] = (step[i - 1] + step[i]) / 3.0;
            band[0] += (0..3)
                .map(|j| own[j] * own[j] * stiffness(i - 1 + j))
                .sum::<f64>();
            if i + 1 < n - 1 {
                let next = column(i + 1);
                band[1] = step[i] / 6.0
                    + own[1] * next[0] * stiffness(i)
                    + own[2] * next[1] * stiffness(i + 1);
            }
            if i + 2 < n - 1 {
                band[2] = own[2] * column(i + 2)[0] * stiffness(i + 1);
            }
            right[k] = (0..3).map(|j| own[j] * values[i - 1 + j]).sum();
        }
        solve(&mut bands, &mut right);
        spline.bends[1..n - 1].copy_from_slice(&right);
        if lambda > 0.0 {
            for i in 1..n - 1 {
                for (j, entry) in column(i).into_iter().enumerate() {
                    spline.values[i - 1 + j] -= stiffness(i - 1 + j) * entry * spline.bends[i];
                }
            }
        }
        spline
    }

    /// First and last knot.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        [self.knots[0], self.knots[self.knots.len() - 1]]
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Value and derivatives; beyond the ends the tangent there.
    #[must_use]
    pub fn at(&self, s: f64) -> SplineValue {
        self.at_in(self.interval(s), s)
    }

    /// Coefficients of the cubic between the knots i and i + 1, by powers of the distance from knot i.
    #[must_use]
    pub fn cubic(&self, i: usize) -> [f64; 4] {
        let jet = self.at_in(i, self.knots[i]);
        let step = self.knots[i + 1] - self.knots[i];
        let bends = self.bends[i + 1] - self.bends[i];
        [jet.value, jet.slope, 0.5 * jet.bend, bends / (6.0 * step)]
    }

    /// The interval of knots that a place lies in, or the nearest one.
    #[must_use]
    pub fn interval(&self, s: f64) -> usize {
        let after = self.knots.partition_point(|knot| *knot <= s);
        after.clamp(1, self.knots.len() - 1) - 1
    }

    /// [`Spline::at`] for a place whose [`Spline::interval`] is known.
    #[must_use]
    pub fn at_in(&self, i: usize, s: f64) -> SplineValue {
        let [first, last] = self.range();
        if s < first || s > last {
            let end = if s < first { first } else { last };
            let jet = self.at(end);
            return SplineValue {
                value: jet.value + jet.slope * (s - end),
                slope: jet.slope,
                bend: 0.0,
            };
        }
        let step = self.knots[i + 1] - self.knots[i];
        let (b, a) = ((s - self.knots[i]) / step, (self.knots[i + 1] - s) / step);
        let (bend_a, bend_b) = (self.bends[i], self.bends[i + 1]);
        SplineValue {
            value: a * self.values[i]
                + b * self.values[i + 1]
                + ((a * a - 1.0) * a * bend_a + (b * b - 1.0) * b * bend_b) * step * step / 6.0,
            slope: (self.values[i + 1] - self.values[i]) / step
                + ((3.0 * b * b - 1.0) * bend_b - (3.0 * a * a - 1.0) * bend_a) * step / 6.0,
            bend: a * bend_a + b * bend_b,
        }
    }
}

/// Solves a symmetric positive definite system with two side bands by LDLᵀ; `bands[i]` holds the entries `(i, i)`,
/// `(i, i + 1)`, `(i, i + 2)`. The solution replaces the right-hand side.
fn solve(bands: &mut [[f64; 3]], right: &mut [f64]) {
    let n = right.len();
    for i in 0..n {
        let [pivot, near, far] = bands[i];
        if i + 1 < n {
            bands[i + 1][0] -= near * near / pivot;
            bands[i + 1][1] -= near * far / pivot;
            right[i + 1] -= near / pivot * right[i];
        }
        if i + 2 < n {
            bands[i + 2][0] -= far * far / pivot;
            right[i + 2] -= far / pivot * right[i];
        }
    }
    for i in (0..n).rev() {
        let [pivot, near, far] = bands[i];
        let mut value = right[i];
        if i + 1 < n {
            value -= near * right[i + 1];
        }
        if i + 2 < n {
            value -= far * right[i + 2];
        }
        right[i] = value / pivot;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(step: f64, f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let knots: Vec<f64> = (0..=400).map(|k| f64::from(k) * step).collect();
        let values = knots.iter().map(|s| f(*s)).collect();
        (knots, values)
    }

    #[test]
    fn interpolation_meets_its_samples_and_is_of_fourth_order_inside() {
        let mut errors = Vec::new();
        for step in [0.02, 0.01] {
            let (knots, values) = sampled(step, f64::sin);
            let spline = Spline::new(&knots, &values, 0.0);
            for (s, value) in knots.iter().zip(&values) {
                assert!((spline.at(*s).value - value).abs() < 1e-14);
            }
            let middle = 2.0 + 0.5 * step;
            errors.push((spline.at(middle).value - middle.sin()).abs());
            assert!((spline.at(middle).slope - middle.cos()).abs() < 1e-6);
            assert!((spline.at(middle).bend + middle.sin()).abs() < 1e-3);
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
                let spline = Spline::new(&knots, &values, 2.0);
                let found = spline.at(4.0).value;
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
        let spline = Spline::pinned(&knots, &values, 3.0, [true, false]);
        assert!((spline.at(0.0).value - values[0]).abs() < 1e-12);
        assert!((spline.at(knots[last]).value - values[last]).abs() > 1e-3);
        let free = Spline::new(&knots, &values, 3.0);
        assert!((free.at(0.0).value - values[0]).abs() > 1e-3);
        // Far from the ends both are the same.
        assert!((free.at(20.0).value - spline.at(20.0).value).abs() < 1e-9);
    }

    #[test]
    fn lines_are_kept_by_any_smoothing() {
        let (knots, values) = sampled(0.1, |s| 3.0 - 0.5 * s);
        let spline = Spline::new(&knots, &values, 50.0);
        for s in [-1.0, 0.0, 3.33, 40.0, 45.0] {
            assert!((spline.at(s).value - (3.0 - 0.5 * s)).abs() < 1e-9);
        }
    }
}
