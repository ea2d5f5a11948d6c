//! Equivalent conicity after EN 15302: that of the cone whose wheelset has the same wavelength at the same amplitude.
//!
//! A free wheelset on a straight track moves by `y'' = −Δr(y) / (e r₀)` over the distance run (Klingel 1883 for a cone, whose
//! `Δr = 2 tan γ y` gives `λ = 2π √(e r₀ / (2 tan γ))`). With `S(y) = ∫ Δr dy` from the place at rest, the motion that turns at two
//! places with `S = E` has the wavelength `λ = 2 ∫ dy / √(2 (E − S) / (e r₀))` between them, and the equivalent conicity is
//! `tan γ = 2 e r₀ (π / λ)²`: e and r₀ drop out. This is the integration of the differential equation of EN 15302 in closed form over
//! a Δr that is linear between its samples; the amplitude is half the distance of the turning points.

use std::f64::consts::PI;

use crate::contact::numerics::bisection::bisect;

/// Places of the quadrature between the turning points, equally spaced in the angle: with linear Δr it is exact.
const PLACES: usize = 2000;
/// Halvings of a bracket; more change nothing.
const HALVINGS: u32 = 60;

/// Difference of the rolling radii over the lateral shift of a wheelset, linear between samples.
#[derive(Debug, Clone, PartialEq)]
pub struct RadiusDifference {
    shift: Vec<f64>,
    difference: Vec<f64>,
    /// Integral of the difference from the first shift.
    integral: Vec<f64>,
}

/// The conicity at one amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conicity {
    /// tan γ by EN 15302.
    pub conicity: f64,
    /// tan γ by harmonic linearisation: the first harmonic of Δr over a sine between the same turning points.
    pub harmonic: f64,
    /// The turning points in mm.
    pub turns: [f64; 2],
}

impl RadiusDifference {
    /// From shifts in mm, strictly increasing and at least two, and differences `left − right` in mm, both as long.
    #[must_use]
    pub fn new(shift: Vec<f64>, difference: Vec<f64>) -> RadiusDifference {
        let mut integral = vec![0.0; shift.len()];
        for k in 1..shift.len() {
            let mean = 0.5 * (difference[k - 1] + difference[k]);
            integral[k] = integral[k - 1] + mean * (shift[k] - shift[k - 1]);
        }
        RadiusDifference {
            shift,
            difference,
            integral,
        }
    }

    /// The same with every second sample, to see what the samples leave open; the sample at the middle is kept.
    #[must_use]
    pub fn coarser(&self) -> RadiusDifference {
        let phase = self.shift.len() / 2 % 2;
        let every = |values: &[f64]| values.iter().copied().skip(phase).step_by(2).collect();
        RadiusDifference::new(every(&self.shift), every(&self.difference))
    }

    /// Samples between which the stable place at rest nearest to shift 0 lies: Δr rises through 0 there.
    fn rest_after(&self) -> Option<usize> {
        let rises = |k: &usize| self.difference[*k] <= 0.0 && self.difference[k + 1] > 0.0;
        let middle = |k: &usize| (self.shift[*k] + self.shift[k + 1]).abs();
        (0..self.shift.len().saturating_sub(1))
            .filter(rises)
            .min_by(|a, b| middle(a).total_cmp(&middle(b)))
    }

    /// The shift in mm at which the radii are equal and to which a free wheelset steers back; none if there is no such shift.
    #[must_use]
    pub fn rest(&self) -> Option<f64> {
        let k = self.rest_after()?;
        let [low, high] = [self.difference[k], self.difference[k + 1]];
        let t = low / (low - high);
        Some(self.shift[k] + t * (self.shift[k + 1] - self.shift[k]))
    }

    /// Δr and its integral at a shift.
    fn at(&self, y: f64) -> [f64; 2] {
        let after = self.shift.partition_point(|shift| *shift <= y);
        let k = after.clamp(1, self.shift.len() - 1) - 1;
        let d = y - self.shift[k];
        let rate =
            (self.difference[k + 1] - self.difference[k]) / (self.shift[k + 1] - self.shift[k]);
        [
            self.difference[k] + rate * d,
            self.integral[k] + d * (self.difference[k] + 0.5 * rate * d),
        ]
    }

    /// Shifts left and right of the rest up to which Δr has one sign, so that its integral rises.
    fn bounds(&self, rest: usize) -> [f64; 2] {
        let low = (0..=rest).rev().take_while(|k| self.difference[*k] <= 0.0);
        let high = (rest + 1..self.shift.len()).take_while(|k| self.difference[*k] > 0.0);
        [
            self.shift[low.last().unwrap_or(rest)],
            self.shift[high.last().unwrap_or(rest + 1)],
        ]
    }

    /// The place between the rest and a bound where the integral reaches `energy`, if it does.
    fn turn(&self, rest: f64, bound: f64, energy: f64) -> Option<f64> {
        if self.at(bound)[1] < energy {
            return None;
        }
        let [_, outside] = bisect([rest, bound], HALVINGS, |at| self.at(at)[1] < energy);
        Some(outside)
    }

    /// The turning points of the motion with an amplitude in mm.
    fn turns(&self, amplitude: f64) -> Option<[f64; 2]> {
        let after = self.rest_after()?;
        let (rest, [low, high]) = (self.rest()?, self.bounds(after));
        let width = |right: f64| {
            let left = self.turn(rest, low, self.at(right)[1])?;
            Some([left, right])
        };
        // The right turning point is bounded by what both sides can reach.
        let wide = |[left, right]: [f64; 2]| right - left >= 2.0 * amplitude;
        if width(high).is_some_and(|turns| !wide(turns)) {
            return None;
        }
        let [inside, _] = bisect([rest, high], HALVINGS, |right| {
            width(right).is_some_and(|turns| !wide(turns))
        });
        let found = width(inside)?;
        // Where the left side ends first, the width stops short of the amplitude.
        (found[1] - found[0] > 2.0 * amplitude * (1.0 - 1e-9)).then_some(found)
    }

    /// The conicity at an amplitude in mm, more than 0; none if there is no stable rest or the samples do not reach as far.
    #[must_use]
    pub fn conicity(&self, amplitude: f64) -> Option<Conicity> {
        let turns = self.turns(amplitude)?;
        let [left, right] = turns;
        let (middle, half) = (0.5 * (left + right), 0.5 * (right - left));
        let energy = self.at(right)[1];
        let step = PI / PLACES as f64;
        let (mut length, mut first) = (0.0, 0.0);
        for k in 0..PLACES {
            let (sin, cos) = (step * (k as f64 + 0.5) - 0.5 * PI).sin_cos();
            let [difference, integral] = self.at(middle + half * sin);
            length += half * cos * step / (2.0 * (energy - integral)).sqrt();
            first += difference * sin * step;
        }
        // The wavelength over √(e r₀) is twice this length.
        let conicity = 0.5 * (PI / length).powi(2);
        let found = Conicity {
            conicity,
            harmonic: first / (PI * half),
            turns,
        };
        found.conicity.is_finite().then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(f: impl Fn(f64) -> f64) -> RadiusDifference {
        let shift: Vec<f64> = (-100..=100).map(|k| 0.1 * f64::from(k)).collect();
        let difference = shift.iter().map(|y| f(*y)).collect();
        RadiusDifference::new(shift, difference)
    }

    #[test]
    fn a_cone_has_its_tangent_at_every_amplitude_about_its_rest() {
        let cone = sampled(|y| 2.0 * 0.025 * (y - 0.7));
        assert!((cone.rest().unwrap() - 0.7).abs() < 1e-12);
        for amplitude in [0.1, 1.0, 3.0, 9.0] {
            let found = cone.conicity(amplitude).unwrap();
            assert!((found.conicity - 0.025).abs() < 1e-9, "{found:?}");
            assert!((found.harmonic - 0.025).abs() < 1e-7, "{found:?}");
            assert!((found.turns[0] - (0.7 - amplitude)).abs() < 1e-6);
        }
        assert!(cone.conicity(9.5).is_none(), "the samples end before");
    }

    /// With Δr = y³ the wavelength is `λ = 4 ∫₀¹ du / √((1 − u⁴) / 2) √(e r₀) / A`, and `∫₀¹ du / √(1 − u⁴) = 1.3110287771461`.
    #[test]
    fn a_cubic_radius_difference_has_its_elliptic_integral() {
        let cubic = sampled(|y| y.powi(3));
        for amplitude in [2.0_f64, 5.0] {
            let length = 4.0 * 2.0_f64.sqrt() * 1.311_028_777_146_1 / amplitude;
            let exact = 2.0 * (PI / length).powi(2);
            let found = cubic.conicity(amplitude).unwrap();
            assert!(
                (found.conicity / exact - 1.0).abs() < 2e-3,
                "{found:?} {exact}"
            );
            // Its first harmonic is 3/4 of the cube.
            let harmonic = 0.375 * amplitude.powi(2);
            assert!((found.harmonic / harmonic - 1.0).abs() < 2e-3, "{found:?}");
        }
    }

    #[test]
    fn a_wheelset_that_steers_away_has_no_rest_and_no_conicity() {
        let unstable = sampled(|y| -0.1 * y);
        assert_eq!(unstable.rest(), None);
        assert_eq!(unstable.conicity(3.0), None);
        // A jump through 0 is a rest, and left and right need not be alike.
        let jump = sampled(|y| if y > 1.05 { 2.0 } else { -1.0 });
        let found = jump.conicity(3.0).unwrap();
        assert!((jump.rest().unwrap() - 1.05).abs() < 0.05);
        let [left, right] = found.turns;
        assert!((right - left - 6.0).abs() < 1e-9);
        assert!(
            ((1.05 - left) / (right - 1.05) - 2.0).abs() < 0.05,
            "{found:?}"
        );
    }
}
