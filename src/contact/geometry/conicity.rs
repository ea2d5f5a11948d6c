//! Equivalent conicity after EN 15302: the conicity of a cone whose wheelset has the same wavelength at the same amplitude.
//!
//! A free wheelset on a straight track moves by `y'' = −Δr(y) / (e r₀)`, with derivatives with respect to the distance run. For a cone,
//! `Δr = 2 tan γ y` gives `λ = 2π √(e r₀ / (2 tan γ))` (Klingel 1883). Let `S(y) = ∫ Δr dy` from the equilibrium. The motion between two turning
//! points with `S = E` has the wavelength `λ = 2 ∫ dy / √(2 (E − S) / (e r₀))`, and the equivalent conicity is `tan γ = 2 e r₀ (π / λ)²`. e and r₀
//! cancel. This integrates the differential equation of EN 15302 in closed form for a Δr that is linear between its samples. The amplitude is
//! half the distance of the turning points. If Δr is 0 over the whole amplitude, as on a flat tread, the wheelset is not steered and the conicity
//! is 0.

use std::f64::consts::PI;
use std::fmt;

use crate::numerics::roots::{HALVINGS, bisect, bounds};

/// Number of points of the quadrature between the turning points, equally spaced in the angle. For a linear Δr it is exact.
const QUADRATURE_POINTS: usize = 2000;
/// Difference in mm up to which two radii are equal. At an amplitude of 1 mm it is a conicity of 0.00005, a twentieth of the last digit of the
/// standard. Conicities below that are 0.
const EQUAL: f64 = 1e-4;

/// Difference of the rolling radii as a function of the lateral shift of a wheelset, linear between samples.
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
    /// tan γ by EN 15302; 0 where the radii are equal over the whole amplitude.
    pub conicity: f64,
    /// tan γ by harmonic linearisation: the first harmonic of Δr over a sine between the same turning points.
    pub harmonic: f64,
    /// The turning points in mm; `None` if the wheelset is not steered back.
    pub turns: Option<[f64; 2]>,
}

/// The reason why there is no conicity at an amplitude; shifts and amplitudes in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoConicity {
    /// Δr does not rise through 0 between these shifts.
    NoEquilibrium([f64; 2]),
    /// The turning points lie beyond these shifts.
    BeyondShifts([f64; 2]),
    /// No motion about the equilibrium has an amplitude between these two, because there is an unstable equilibrium.
    PassesUnstable([f64; 2]),
}

impl fmt::Display for NoConicity {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoConicity::NoEquilibrium([from, until]) => write!(
                to,
                "there is no stable equilibrium: the radius difference does not rise through 0 at shifts from {from:.2} to {until:.2} mm"
            ),
            NoConicity::BeyondShifts([from, until]) => write!(
                to,
                "the motion reverses outside the shifts from {from:.2} to {until:.2} mm for which the radius difference is known"
            ),
            NoConicity::PassesUnstable([from, until]) => write!(
                to,
                "no motion has this amplitude: at {from:.2} mm the motion reaches an unstable equilibrium, beyond which \
                 amplitudes are at least {until:.2} mm"
            ),
        }
    }
}

/// An equilibrium of the wheelset.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    shift: f64,
    /// Integral of the difference there.
    integral: f64,
}

impl RadiusDifference {
    /// Makes the function from at least two strictly increasing shifts in mm, and as many differences `left − right` in mm.
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

    /// First and last shift in mm.
    pub fn range(&self) -> [f64; 2] {
        [self.shift[0], self.shift[self.shift.len() - 1]]
    }

    /// The stable equilibrium nearest to 0: the shift in mm at which the radii are equal and to which a free wheelset steers back. If the radii
    /// are equal over a range of shifts, its middle is returned. Returns `None` if there is no such shift.
    pub fn rest(&self) -> Option<f64> {
        let sign = |k: usize| {
            let difference = self.difference[k];
            f64::from(i8::from(difference > EQUAL) - i8::from(difference < -EQUAL))
        };
        let crossing = |k: usize, value: f64| {
            let [low, high] = [self.difference[k], self.difference[k + 1]];
            self.shift[k] + (value - low) / (high - low) * (self.shift[k + 1] - self.shift[k])
        };
        let mut nearest: Option<[f64; 2]> = None;
        // The beginning of the current range of equal radii. Below the first shift the wheelset is taken to steer back.
        let mut since = (sign(0) == 0.0).then_some(self.shift[0]);
        let mut consider = |[from, to]: [f64; 2]| {
            let off = |[from, to]: [f64; 2]| from.max(-to).max(0.0);
            if nearest.is_none_or(|known| off([from, to]) < off(known)) {
                nearest = Some([from, to]);
            }
        };
        for k in 0..self.shift.len() - 1 {
            let [before, after] = [sign(k), sign(k + 1)];
            if before < 0.0 && after >= 0.0 {
                since = Some(crossing(k, -EQUAL));
            }
            if after < 0.0 {
                since = None;
            } else if after > 0.0
                && let Some(from) = since.take()
            {
                consider([from, crossing(k, EQUAL)]);
            }
        }
        if let Some(from) = since {
            consider([from, self.range()[1]]);
        }
        nearest.map(|[from, to]| 0.5 * (from + to))
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

    /// The shifts on both sides of the equilibrium at which the integral first exceeds that of the equilibrium by `energy`, or the ends of the
    /// known shifts.
    fn turns(&self, rest: Rest, energy: f64) -> [f64; 2] {
        let level = rest.integral + energy;
        let after = self.shift.partition_point(|shift| *shift <= rest.shift);
        let turn = |mut beyond: Box<dyn Iterator<Item = usize>>| {
            let mut inside = rest.shift;
            let outside = beyond.find(|k| {
                let exceeds = self.integral[*k] >= level;
                if !exceeds {
                    inside = self.shift[*k];
                }
                exceeds
            });
            outside.map_or(inside, |k| {
                bisect([inside, self.shift[k]], HALVINGS, |y| self.at(y)[1] < level)[1]
            })
        };
        let right = after..self.shift.len();
        [turn(Box::new((0..after).rev())), turn(Box::new(right))]
    }

    /// The largest rise of the integral above that of the equilibrium, on the side where it rises less.
    fn highest(&self, rest: Rest) -> f64 {
        let after = self.shift.partition_point(|shift| *shift <= rest.shift);
        let most = |values: &[f64]| bounds(values.iter().copied())[1];
        let [left, right] = [&self.integral[..after], &self.integral[after..]].map(most);
        (left.min(right) - rest.integral).max(0.0)
    }

    /// The conicity at a positive amplitude in mm.
    ///
    /// # Errors
    /// Returns the reason why there is none.
    pub fn conicity(&self, amplitude: f64) -> Result<Conicity, NoConicity> {
        let Some(shift) = self.rest() else {
            return Err(NoConicity::NoEquilibrium(self.range()));
        };
        let rest = Rest {
            shift,
            integral: self.at(shift)[1],
        };
        let wide = |[left, right]: [f64; 2]| right - left >= 2.0 * amplitude;
        // A cone of the conicity γ has the energy γ A². Rises of the integral up to that of a negligible cone are ignored.
        let least = EQUAL * amplitude.powi(2);
        let flat = self.turns(rest, least);
        if wide(flat) {
            let middle = shift.max(flat[0] + amplitude).min(flat[1] - amplitude);
            return Ok(Conicity {
                conicity: 0.0,
                harmonic: self.harmonic(middle, amplitude),
                turns: None,
            });
        }
        let most = self.highest(rest);
        let reached = self.turns(rest, most);
        if most <= least || !wide(reached) {
            return Err(NoConicity::BeyondShifts(self.range()));
        }
        let [low, high] = bisect([least, most], HALVINGS, |energy| {
            !wide(self.turns(rest, energy))
        });
        let [inside, outside] = [low, high].map(|energy| self.turns(rest, energy));
        let amplitudes = [inside, outside].map(|[left, right]| 0.5 * (right - left));
        if amplitudes[1] - amplitudes[0] > 1e-3 * amplitude {
            return Err(NoConicity::PassesUnstable(amplitudes));
        }
        let [left, right] = outside;
        let (middle, half) = (0.5 * (left + right), 0.5 * (right - left));
        let step = PI / QUADRATURE_POINTS as f64;
        let mut length = 0.0;
        for k in 0..QUADRATURE_POINTS {
            let (sin, cos) = (step * (k as f64 + 0.5) - 0.5 * PI).sin_cos();
            let integral = self.at(middle + half * sin)[1] - rest.integral;
            length += half * cos * step / (2.0 * (high - integral)).sqrt();
        }
        // The wavelength over √(e r₀) is twice this length. It is infinite if the motion ends at an unstable equilibrium.
        let conicity = 0.5 * (PI / length).powi(2);
        Ok(Conicity {
            conicity: if conicity.is_finite() { conicity } else { 0.0 },
            harmonic: self.harmonic(middle, half),
            turns: Some([left, right]),
        })
    }

    /// First harmonic of Δr over a sine about `middle`, relative to that of a cone.
    fn harmonic(&self, middle: f64, half: f64) -> f64 {
        let step = PI / QUADRATURE_POINTS as f64;
        let first = |k: usize| {
            let sin = (step * (k as f64 + 0.5) - 0.5 * PI).sin();
            self.at(middle + half * sin)[0] * sin * step
        };
        (0..QUADRATURE_POINTS).map(first).sum::<f64>() / (PI * half)
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
            assert!((found.turns.unwrap()[0] - (0.7 - amplitude)).abs() < 1e-6);
        }
        let missing = cone.conicity(9.5).unwrap_err();
        assert!(matches!(missing, NoConicity::BeyondShifts(_)), "{missing}");
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
        let missing = unstable.conicity(3.0).unwrap_err();
        assert!(matches!(missing, NoConicity::NoEquilibrium(_)), "{missing}");
        // A jump through 0 is an equilibrium, and the motion need not be symmetric.
        let jump = sampled(|y| if y > 1.05 { 2.0 } else { -1.0 });
        let found = jump.conicity(3.0).unwrap();
        assert!((jump.rest().unwrap() - 1.05).abs() < 0.05);
        let [left, right] = found.turns.unwrap();
        assert!((right - left - 6.0).abs() < 1e-9);
        assert!(
            ((1.05 - left) / (right - 1.05) - 2.0).abs() < 0.05,
            "{found:?}"
        );
    }

    /// A flat tread between two flanges: no conicity on the tread, and beyond it that of the flanges.
    #[test]
    fn equal_radii_have_the_conicity_zero_until_the_flanges_steer() {
        let flanges = |y: f64| 0.3 * (y.abs() - 1.7).max(0.0) * y.signum();
        let noise = |y: f64| 5e-5 * (40.0 * y).sin();
        for flat in [
            sampled(flanges),
            sampled(|y| flanges(y) + noise(y)),
            sampled(|y| flanges(y - 0.4)),
        ] {
            for amplitude in [0.2, 1.0, 1.6] {
                let found = flat.conicity(amplitude).unwrap();
                assert_eq!((found.conicity, found.turns), (0.0, None), "{found:?}");
                assert!(found.harmonic.abs() < 1e-4, "{found:?}");
            }
            // With a flat tread of the half width w, each flange takes π/2 √(1/0.3) mm of the way, and the tread takes w/v with v = √0.3 (A − w).
            for amplitude in [2.0_f64, 4.0, 8.0] {
                let beyond = amplitude - 1.7;
                let half = PI / 0.3_f64.sqrt() + 2.0 * 1.7 / (0.3_f64.sqrt() * beyond);
                let exact = 0.5 * (PI / half).powi(2);
                let found = flat.conicity(amplitude).unwrap();
                assert!(
                    (found.conicity / exact - 1.0).abs() < 0.02,
                    "{found:?} {exact}"
                );
            }
        }
        // Cylinders without flanges are flat as far as they are known.
        let cylinders = sampled(|_| 0.0);
        assert_eq!(cylinders.rest(), Some(0.0));
        assert_eq!(cylinders.conicity(5.0).unwrap().conicity, 0.0);
        assert!(sampled(|_| 0.2).conicity(1.0).is_err());
    }

    /// Small waves of Δr about 0 do not stop a motion that is larger; a barrier that does is named.
    #[test]
    fn a_motion_passes_small_barriers_and_a_missing_amplitude_is_explained() {
        let wavy = sampled(|y| 0.1 * y + 0.005 * (4.0 * y).sin() * (-y * y).exp());
        let found = wavy.conicity(4.0).unwrap();
        assert!((found.conicity / 0.05 - 1.0).abs() < 0.05, "{found:?}");
        // Stable at ±2, unstable at 0: about 2 the motion cannot have an amplitude between 1.4 and 2.8.
        let double = sampled(|y| 0.02 * y * (y * y - 4.0));
        let missing = double.conicity(2.2).unwrap_err();
        let NoConicity::PassesUnstable([from, until]) = missing else {
            panic!("{missing}")
        };
        assert!((from - 2.0_f64.sqrt()).abs() < 0.02, "{from}");
        assert!((until - 8.0_f64.sqrt()).abs() < 0.02, "{until}");
        assert!(double.conicity(1.0).is_ok() && double.conicity(3.5).is_ok());
    }
}
