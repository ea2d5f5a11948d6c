//! Expresses the difference between two readings of a profile as the pressure that would flatten it.
//!
//! On a half-space a wave of amplitude c and length L is flattened by the pressure `π E* c / L` (Johnson, Contact Mechanics, 1985, §13.2),
//! or `q = E* |k| r / 2` for the wavenumber k. Every difference r(s) is thus converted to a pressure that can be compared with that of the
//! contact.

use std::cell::RefCell;
use std::f64::consts::{PI, TAU};

use realfft::RealFftPlanner;

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
