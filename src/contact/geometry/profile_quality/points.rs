//! The quality of a profile under a contact, and the smoothing that its noise requires.

use crate::contact::geometry::profile_quality::noise;
use crate::contact::geometry::profile_quality::noise::Oddity;
use crate::contact::geometry::profile_quality::readings::noise_pressure;
use crate::contact::geometry::profile_quality::readings::{
    KnownStretches, PointsRead, REFERENCE_MIN, Roughness,
};

/// Range of smoothing lengths that are advised, in mm. Shorter ones do not remove the noise of neighbouring points, longer ones distort
/// gauge corners and flange roots (radii of 13 to 20 mm; 5 mm changes the largest pressure by 2 %, 10 mm by 27 % in one of ten cases).
pub const SMOOTHING_ADVISED: [f64; 2] = [2.0, 8.0];
/// Noise, as a share of the largest pressure, that remains after the advised smoothing. Between 0.05 and 0.1 neither pressures nor forces
/// change by more than their scatter; population: 18 places on three pairs with noise of 1 to 20 µm.
const NOISE_LEFT: f64 = 0.07;
/// Noise without smoothing, as a share of the largest pressure, below which no smoothing is advised.
const NOISE_HARMLESS: f64 = 0.01;
/// Smoothing length, in chords, that turns a polygon into a smooth curve.
const CHORDS: f64 = 2.0;
/// Noise in steps of rounding: the deviation of an even distribution of width 1 is 1/√12. Up to twice this it is due to the rounding.
const ROUNDED: f64 = 0.289;
const ROUNDED_MAX: f64 = 2.0 * ROUNDED;
/// Waviness over that which the noise explains, up to which noise is its cause: estimates from few points scatter by a factor of 2.
const EXPLAINED: f64 = 3.0;
/// Additional distance in mm over which noise is measured.
const AROUND: f64 = 10.0;

/// Quality of the points of one body under one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnderContact {
    /// The longest chord that overlaps the contact, as its ends along the profile in mm.
    pub chord: [f64; 2],
    /// Its length relative to the width of the contact.
    pub over_width: f64,
    /// Mean distance of the points around the contact, in mm.
    pub spacing: f64,
    /// Standard deviation of the noise along the normal in mm, if there are enough points to determine it.
    pub noise: Option<f64>,
    /// Waviness and ambiguity, as pressures.
    pub roughness: Roughness,
    /// Length of the chords, if the points lie on those of a polygon.
    pub polygon: Option<f64>,
    /// The worst defect of few points near the contact.
    pub oddity: Option<Oddity>,
    /// Whether noise or rounding explain the waviness.
    pub noisy: bool,
    /// Step in mm to which the heights were rounded, if the noise is due to that.
    pub rounding: Option<f64>,
}

/// Standard deviation in mm of the noise of the points in a range, along the normal; `None` if too few of them are close enough together to
/// determine it. Heights that were rounded have at least the noise of the rounding: where a profile is level, neighbours are equal.
#[must_use]
pub fn noise_of(reading: &PointsRead, range: [usize; 2]) -> Option<f64> {
    let least = ROUNDED * reading.rounding.unwrap_or(0.0);
    Some(noise::noise(reading.points, range)?.max(least))
}

/// Length in mm of the chords if the points of a range were interpolated linearly between fewer points.
#[must_use]
pub fn polygon_of(reading: &PointsRead, range: [usize; 2]) -> Option<f64> {
    noise::polygon(reading.points, range, reading.digits)
}

/// Quality of the points of a body under the contact `[low, high]` (mm along the profile); the contact modulus is in MPa.
#[must_use]
pub fn under_contact(
    reading: &PointsRead,
    known: &KnownStretches,
    contact: [f64; 2],
    modulus: f64,
) -> UnderContact {
    let points = reading.points;
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
    let near = half.max(REFERENCE_MIN);
    let near = points.numbers([low - near, high + near]);
    let noise = noise_of(reading, around).or_else(|| noise_of(reading, whole));
    let roughness = known.about(reading, contact).roughness(contact, modulus);
    let rounding = reading.rounding;
    let rounding = rounding.filter(|step| noise.is_some_and(|noise| noise <= ROUNDED_MAX * step));
    let white = rounding.is_some() || noise::is_white(points, around);
    let cut = reading.smoothing.max(2.0 * spacing);
    let explained = noise_pressure(modulus, noise.unwrap_or(0.0), spacing, cut);
    UnderContact {
        chord: [points.along[widest], points.along[widest + 1]],
        over_width: points.chord(widest) / (high - low),
        spacing,
        noise,
        roughness,
        polygon: polygon_of(reading, around),
        oddity: noise::oddity(points, near),
        noisy: white && roughness.waviness <= EXPLAINED * explained,
        rounding,
    }
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

/// The smoothing advised for each of two bodies, in mm, given the largest pressure and the contact modulus in MPa; 0 if none is needed.
///
/// `L = (2.34 E* √(s₁² h₁ + s₂² h₂) / (0.07 p))^(2/3)` leaves noise of 7 % of the pressure (see [`noise_pressure`]); it is limited to 2 to
/// 8 mm. A body whose own noise without smoothing is below 1 % of the pressure is not smoothed; a polygon is smoothed by at least two
/// chords.
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
