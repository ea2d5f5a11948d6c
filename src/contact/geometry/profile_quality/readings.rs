//! Compares two readings of the same points: the spline in use with a smoother one, and with Akima's curve.

use std::cell::RefCell;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

use realfft::RealFftPlanner;

use crate::contact::geometry::plane_curve::{CurvePoint, PlaneCurve};
use crate::contact::geometry::profile_quality::noise::{MEDIAN_OF_NORMAL, median};
use crate::contact::geometry::profile_quality::samples::Points;
use crate::contact::numerics::hermite::{akima_slopes, value};

/// Bounds of the spacing of the comparison in mm. With 0.1 as the upper one and five places from point to point rows of a pair take some per
/// cent more time; it was not measured how the readings differ beyond the tests, and the class *damaged profile* of `docs/stability.md`.
const STEP: [f64; 2] = [0.05, 0.2];
/// Places of the comparison from one point to the next, within these bounds. Chosen by judgement: a cubic between two points is seen.
const PLACES: f64 = 4.0;
/// Distance in mm by which the comparison extends beyond twice the half width of the contact.
const BEYOND: f64 = 10.0;
/// Distance, in cut wavelengths, beyond which points do not affect a smoothed curve.
const SUPPORT: f64 = 3.0;
/// Least smoothing of the reference in mm; otherwise it is twice the length in use. A point changes the reference up to this far away.
pub const REFERENCE_MIN: f64 = 3.0;
/// Most places at which curves are compared, however wide the contact.
const SAMPLES_MAX: usize = 4000;

/// Roughness under a contact as pressures in MPa.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Roughness {
    /// Root mean square over the contact of the waves between the smoothing in use and twice that, or 3 mm.
    pub waviness: f64,
    /// Deviation of the same waves, from the median in and beside the contact: small if the waviness comes from a single place.
    pub everywhere: f64,
    /// Root mean square of the difference between the spline in use and Akima's curve through the same points; 0 with smoothing.
    pub ambiguity: f64,
}

/// Length in mm to whose multiples stretches are cut: contacts that lie near each other share one. Chosen by judgement: contacts of one pair
/// then need a dozen stretches.
const STRETCH: f64 = 10.0;
/// Most stretches that are kept for one profile. Keeps the memory small; it changes times, no answer.
const STRETCHES_MAX: usize = 32;

/// How the readings of a stretch of a profile differ, at places with equal distances.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileStretch {
    /// The first place in mm along the profile.
    first: f64,
    /// Distance of the places in mm.
    step: f64,
    /// The waves between the smoothing in use and twice that, or 3 mm: the pressure that flattens them over the contact modulus.
    waves: Vec<f64>,
    /// The same of the difference between the spline in use and Akima's curve; empty with smoothing.
    ambiguity: Vec<f64>,
    /// Deviation of the waves, from their median.
    everywhere: f64,
}

/// The stretches of one profile that were asked for. They follow from the profile, so that two of them never make profiles differ.
#[derive(Debug, Default)]
pub struct KnownStretches(Mutex<Vec<([f64; 2], Arc<ProfileStretch>)>>);

impl PartialEq for KnownStretches {
    fn eq(&self, _: &KnownStretches) -> bool {
        true
    }
}

impl KnownStretches {
    /// The stretch about a contact on the profile with these points and this curve through them.
    #[must_use]
    pub fn about(&self, reading: &PointsRead, contact: [f64; 2]) -> Arc<ProfileStretch> {
        let window = stretch_about(reading.points, contact);
        // A panic while it was held leaves the list as it is: only whole stretches are put there.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, stretch)) = known.iter().find(|(of, _)| *of == window) {
            return Arc::clone(stretch);
        }
        let stretch = Arc::new(ProfileStretch::new(reading, window));
        if known.len() == STRETCHES_MAX {
            known.remove(0);
        }
        known.push((window, Arc::clone(&stretch)));
        stretch
    }
}

/// The points of a profile and the curve in use.
#[derive(Debug, Clone, Copy)]
pub struct PointsRead<'a> {
    /// The points.
    pub points: Points<'a>,
    /// The curve through them, or past them where it is smoothed.
    pub curve: &'a PlaneCurve,
    /// Cut wavelength of its smoothing in mm; 0 for none.
    pub smoothing: f64,
    /// Step in mm of which all coordinates are multiples.
    pub digits: f64,
    /// Step in mm of which all heights are multiples, if it is 0.001 mm or more.
    pub rounding: Option<f64>,
}

/// Both ends of the stretch that the roughness at a contact is taken from, in mm along the profile.
fn stretch_about(points: Points, [low, high]: [f64; 2]) -> [f64; 2] {
    let half = 0.5 * (high - low);
    let last = points.along.len() - 1;
    [
        (((low - half - BEYOND) / STRETCH).floor() * STRETCH).max(points.along[0]),
        (((high + half + BEYOND) / STRETCH).ceil() * STRETCH).min(points.along[last]),
    ]
}

impl ProfileStretch {
    /// The readings compared between two places in mm along the profile.
    fn new(reading: &PointsRead, window: [f64; 2]) -> ProfileStretch {
        let PointsRead {
            points,
            curve,
            smoothing,
            ..
        } = *reading;
        let reference = REFERENCE_MIN.max(2.0 * smoothing);
        let part = points.within([
            window[0] - SUPPORT * reference,
            window[1] + SUPPORT * reference,
        ]);
        let spacing =
            (part.along[part.along.len() - 1] - part.along[0]) / (part.along.len() - 1) as f64;
        let step = (spacing / PLACES).clamp(STEP[0], STEP[1]);
        let step = step.max((window[1] - window[0]) / SAMPLES_MAX as f64);
        let count = ((window[1] - window[0]) / step).floor() as usize + 1;
        let places: Vec<f64> = (0..count).map(|k| window[0] + step * k as f64).collect();
        let used: Vec<CurvePoint> = places.iter().map(|s| curve.at(*s)).collect();
        let pressures = |other: &dyn Fn(f64) -> [f64; 2]| {
            let heights: Vec<f64> = (used.iter().zip(&places))
                .map(|(used, s)| above(used, other(*s)))
                .collect();
            flattening(&heights, step, 1.0)
        };
        let smoother = PlaneCurve::through(part.at, part.along, reference);
        let waves = pressures(&|s| smoother.at(s).at);
        let ambiguity = if smoothing > 0.0 {
            Vec::new()
        } else {
            let values = [0, 1].map(|k| part.at.iter().map(|at| at[k]).collect::<Vec<_>>());
            let slopes = [0, 1].map(|k| akima_slopes(part.along, &values[k]));
            pressures(&|s| [0, 1].map(|k| value(part.along, &values[k], &slopes[k], s)))
        };
        let mut sizes: Vec<f64> = waves.iter().map(|pressure| pressure.abs()).collect();
        ProfileStretch {
            first: window[0],
            step,
            waves,
            ambiguity,
            everywhere: median(&mut sizes) / MEDIAN_OF_NORMAL,
        }
    }

    /// Roughness at the contact `[low, high]` (mm along the profile); the contact modulus is in MPa.
    #[must_use]
    pub fn roughness(&self, [low, high]: [f64; 2], modulus: f64) -> Roughness {
        let place = |k: usize| self.first + self.step * k as f64;
        let over_contact = |pressures: &[f64]| {
            let (mut sum, mut count) = (0.0, 0.0_f64);
            for (k, pressure) in pressures.iter().enumerate() {
                if (low..=high).contains(&place(k)) {
                    sum += pressure * pressure;
                    count += 1.0;
                }
            }
            modulus * (sum / count.max(1.0)).sqrt()
        };
        Roughness {
            waviness: over_contact(&self.waves),
            everywhere: modulus * self.everywhere,
            ambiguity: over_contact(&self.ambiguity),
        }
    }
}

/// Distance from a point of a spline to that of another curve along its normal, positive if the spline is above.
fn above(CurvePoint { at, slope, .. }: &CurvePoint, [other_y, other_z]: [f64; 2]) -> f64 {
    let length = slope[0].hypot(slope[1]).max(f64::MIN_POSITIVE);
    (slope[0] * (at[1] - other_z) - slope[1] * (at[0] - other_y)) / length
}

/// Length in mm over which heights are tapered to 0 at both ends.
const TAPER: f64 = 2.0;
/// Padded length relative to that of the heights; the zeros keep the periodic transform from coupling the two ends.
const PADDING: usize = 2;

thread_local! {
    /// Plans of the transforms, which take longer to make than to use. They follow from their lengths alone; there are a dozen at most.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// Pressure in MPa that flattens `heights` in mm, `step` mm apart, with the contact modulus in MPa; one value per height.
pub fn flattening(heights: &[f64], step: f64, modulus: f64) -> Vec<f64> {
    let count = heights.len();
    let padded = (PADDING * count).max(2).next_power_of_two();
    let mut values = vec![0.0; padded];
    for (k, height) in heights.iter().enumerate() {
        let from_end = step * k.min(count - 1 - k) as f64;
        values[k] = if from_end < TAPER {
            height * 0.5 * (1.0 - (PI * from_end / TAPER).cos())
        } else {
            *height
        };
    }
    let (forward, backward) = PLANNER.with_borrow_mut(|planner| {
        (
            planner.plan_fft_forward(padded),
            planner.plan_fft_inverse(padded),
        )
    });
    let mut spectrum = forward.make_output_vec();
    // The buffers have the lengths of the plans, so that neither transform can fail.
    let done = forward.process(&mut values, &mut spectrum);
    debug_assert!(done.is_ok());
    for (m, entry) in spectrum.iter_mut().enumerate() {
        let wavenumber = TAU * m as f64 / (padded as f64 * step);
        *entry *= 0.5 * modulus * wavenumber / padded as f64;
    }
    if let Some(last) = spectrum.last_mut() {
        last.im = 0.0;
    }
    spectrum[0].im = 0.0;
    let done = backward.process(&mut spectrum, &mut values);
    debug_assert!(done.is_ok());
    values.truncate(count);
    values
}

/// Pressure in MPa that white noise of deviation `noise` mm at a spacing of `spacing` mm leaves after a smoothing that halves
/// waves of `cut` mm: `2.34 E* s √(h/L³)`, from `2 (π E*)² s² h / L³ · ∫ x²/(1+x⁴)² dx` with the integral `π√2/16`.
#[must_use]
pub fn noise_pressure(modulus: f64, noise: f64, spacing: f64, cut: f64) -> f64 {
    2.34 * modulus * noise * (spacing / cut.powi(3)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULUS: f64 = 115_000.0;
    const CONTACT: [f64; 2] = [25.0, 35.0];

    /// Points 0.25 mm apart on a circle of 300 mm with a height of their own each.
    fn crown(height: impl Fn(f64) -> f64) -> (Vec<[f64; 2]>, Vec<f64>) {
        let along: Vec<f64> = (0..=240).map(|k| 0.25 * f64::from(k)).collect();
        let at = along
            .iter()
            .map(|s| [*s, -(s - 30.0).powi(2) / 600.0 + height(*s)])
            .collect();
        (at, along)
    }

    fn of(smoothing: f64, height: impl Fn(f64) -> f64) -> Roughness {
        let (at, along) = crown(height);
        found(&at, &along, smoothing)
    }

    fn found(at: &[[f64; 2]], along: &[f64], smoothing: f64) -> Roughness {
        let points = Points { at, along };
        let reading = PointsRead {
            points,
            curve: &PlaneCurve::through(at, along, smoothing),
            smoothing,
            digits: 0.0,
            rounding: None,
        };
        let stretch = KnownStretches::default().about(&reading, CONTACT);
        stretch.roughness(CONTACT, MODULUS)
    }

    #[test]
    fn a_smooth_crown_is_not_rough_by_any_reading() {
        let found = of(0.0, |_| 0.0);
        assert!(found.waviness < 1.0, "{found:?}");
        assert!(found.ambiguity < 1.0, "{found:?}");
    }

    /// A spline that halves 3 mm keeps the part `1/(1+(3/L)⁴)` of a wave of length L; the rest is seen.
    #[test]
    fn a_wave_is_worth_the_pressure_that_flattens_it_as_far_as_the_reference_takes_it_away() {
        let amplitude = 0.002;
        for length in [1.0, 2.0, 3.0, 4.0] {
            let wave = |s: f64| amplitude * (TAU * s / length).cos();
            let found = of(0.0, wave).waviness;
            let taken = 1.0 - 1.0 / (1.0 + (3.0 / length).powi(4));
            let flat = PI * MODULUS * amplitude / length;
            let expected = taken * flat / 2.0_f64.sqrt();
            assert!(
                (found / expected - 1.0).abs() < 0.1,
                "{length} mm: {found} MPa, {expected} expected"
            );
        }
    }

    #[test]
    fn a_single_dent_is_not_everywhere_and_a_wave_is() {
        let dent = of(0.0, |s| 0.005 * (-(s - 30.0).powi(2) / 0.1).exp());
        assert!(dent.everywhere < 0.1 * dent.waviness, "{dent:?}");
        let wave = of(0.0, |s| 0.002 * (4.0 * s).cos());
        assert!(wave.everywhere > 0.5 * wave.waviness, "{wave:?}");
    }

    #[test]
    fn coarse_points_on_a_bend_leave_the_curve_open_and_a_smoothing_does_not_ask() {
        let (at, along) = crown(|s| {
            if s > 30.0 {
                -(s - 30.0).powi(2) / 26.0
            } else {
                0.0
            }
        });
        let every = |step: usize| -> (Vec<[f64; 2]>, Vec<f64>) {
            let at: Vec<_> = at.iter().copied().step_by(step).collect();
            (at, along.iter().copied().step_by(step).collect())
        };
        let open = |step: usize, smoothing: f64| {
            let (at, along) = every(step);
            found(&at, &along, smoothing).ambiguity
        };
        assert!(
            open(8, 0.0) > 3.0 * open(1, 0.0),
            "{} {}",
            open(8, 0.0),
            open(1, 0.0)
        );
        assert_eq!(open(8, 3.0), 0.0);
    }
}
