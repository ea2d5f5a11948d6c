//! What a profile is like under a contact, and the smoothing that its noise calls for.

use crate::contact::geometry::profile_quality::flattening::noise_pressure;
use crate::contact::geometry::profile_quality::noise;
use crate::contact::geometry::profile_quality::noise::{Outlier, Step};
use crate::contact::geometry::profile_quality::readings::{Roughness, roughness};
use crate::contact::geometry::profile_quality::samples::Points;

/// Smoothing lengths that are advised, in mm: shorter ones leave the noise of neighbouring points, longer ones take away the shape of
/// gauge corners and flange roots (radii of 13 to 20 mm; at 5 mm 2 % of the largest pressure, at 10 mm 27 % in one of ten).
pub const SMOOTHING_ADVISED: [f64; 2] = [2.0, 8.0];
/// Part of the largest pressure that noise may be worth after the advised smoothing. Between 0.05 and 0.1 neither pressures nor forces change
/// by more than their scatter; population: 18 places on three pairs with noise of 1 to 20 µm.
const NOISE_LEFT: f64 = 0.07;
/// Noise worth less than this part of the pressure without any smoothing needs none.
const NOISE_HARMLESS: f64 = 0.01;
/// A smoothing by so many chords turns a polygon into a curve.
const CHORDS: f64 = 2.0;
/// Outliers and steps count up to this distance from the contact, in its half widths.
const NEAR: f64 = 2.0;
/// Noise is measured up to this distance in mm beyond that.
const AROUND: f64 = 10.0;

/// What the points of one body are like under one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnderContact {
    /// The widest chord that meets the contact, as its ends along the profile in mm.
    pub chord: [f64; 2],
    /// Its length over the width of the contact.
    pub over_width: f64,
    /// Mean distance of the points around.
    pub spacing: f64,
    /// Deviation of the noise along the normal in mm, where there are enough points to tell.
    pub noise: Option<f64>,
    /// Waviness and ambiguity as pressures.
    pub roughness: Roughness,
    /// Length of the chords, if the points lie on those of a polygon.
    pub polygon: Option<f64>,
    /// The farthest outlier near the contact.
    pub outlier: Option<Outlier>,
    /// The largest step near the contact.
    pub step: Option<Step>,
}

/// Looks at the points of a body under the contact `[low, high]` (mm along the profile), smoothed by `smoothing` mm, with the contact
/// modulus in MPa.
#[must_use]
pub fn under_contact(
    points: Points,
    smoothing: f64,
    contact: [f64; 2],
    modulus: f64,
) -> UnderContact {
    let [low, high] = contact;
    let half = 0.5 * (high - low);
    let last_chord = points.at.len() - 2;
    let first = points.along.partition_point(|s| *s <= low).max(1) - 1;
    let last = points.along.partition_point(|s| *s < high).max(1) - 1;
    let widest = (first..=last.min(last_chord))
        .max_by(|a, b| points.chord(*a).total_cmp(&points.chord(*b)))
        .unwrap_or(first.min(last_chord));
    let wide = [low - half - AROUND, high + half + AROUND];
    let around = points.numbers(wide);
    let count = around[1] - around[0];
    let spacing = if count > 1 {
        (points.along[around[1] - 1] - points.along[around[0]]) / (count - 1) as f64
    } else {
        points.chord(widest)
    };
    let whole = [0, points.at.len()];
    let near = points.numbers([middle(contact) - NEAR * half, middle(contact) + NEAR * half]);
    let (outlier, step) = noise::oddities(points, near);
    UnderContact {
        chord: [points.along[widest], points.along[widest + 1]],
        over_width: points.chord(widest) / (high - low),
        spacing,
        noise: noise::noise(points, around).or_else(|| noise::noise(points, whole)),
        roughness: roughness(points, smoothing, contact, modulus),
        polygon: noise::polygon(points, around),
        outlier,
        step,
    }
}

fn middle([low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high)
}

/// Noise and spacing of one body, in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Grain {
    /// Deviation of the noise along the normal.
    pub noise: f64,
    /// Mean distance of the points.
    pub spacing: f64,
    /// Length of the chords, if the points lie on those of a polygon.
    pub polygon: Option<f64>,
}

/// Smoothing in mm that is advised for each of two bodies with a largest pressure and a contact modulus in MPa; 0 where none is needed.
///
/// `L = (2.34 E* √(s₁² h₁ + s₂² h₂) / (0.07 p))^(2/3)` leaves noise of 7 % of the pressure (see [`noise_pressure`]), held between 2 and
/// 8 mm. A body whose own noise is worth less than 1 % of the pressure without smoothing gets none; a polygon is smoothed by two chords at
/// least.
#[must_use]
pub fn advised_smoothing(bodies: [Grain; 2], modulus: f64, pressure: f64) -> [f64; 2] {
    let share = |body: &Grain| body.noise * body.spacing.sqrt();
    let both = share(&bodies[0]).hypot(share(&bodies[1]));
    let [least, most] = SMOOTHING_ADVISED;
    let length = (2.34 * modulus * both / (NOISE_LEFT * pressure)).powf(2.0 / 3.0);
    bodies.map(|body| {
        let raw = noise_pressure(modulus, body.noise, body.spacing, 2.0 * body.spacing);
        let of_noise = if raw < NOISE_HARMLESS * pressure {
            0.0
        } else {
            length.clamp(least, most)
        };
        let of_polygon = body
            .polygon
            .map_or(0.0, |chord| (CHORDS * chord).clamp(least, most));
        of_noise.max(of_polygon)
    })
}
