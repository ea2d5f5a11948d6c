//! Two readings of the same points: the spline in use against a smoother one, and against Akima's curve.

use crate::contact::geometry::profile_quality::Points;
use crate::contact::geometry::profile_quality::flattening::flattening;
use crate::contact::geometry::profile_quality::noise::{MEDIAN_OF_NORMAL, median};
use crate::contact::geometry::smoothing::Spline;

/// Spacing of the comparison in mm.
const STEP: f64 = 0.05;
/// What is compared reaches beyond twice the half width of the contact by this, in mm.
const BEYOND: f64 = 10.0;
/// Points farther beyond do not change a smoothed curve there, in cut wavelengths.
const SUPPORT: f64 = 3.0;
/// The reference is smoothed by twice the length in use, at least by this, in mm.
const REFERENCE_MIN: f64 = 3.0;
/// The contact is looked at in no more places than this, however wide it is.
const SAMPLES_MAX: usize = 4000;

/// Roughness under a contact as pressures in MPa.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Roughness {
    /// Of the waves between the smoothing in use and twice that, or 3 mm: root of the mean square over the contact.
    pub waviness: f64,
    /// The same as the median over the contact and what lies beside it, as a deviation: small where a single place makes the waviness.
    pub everywhere: f64,
    /// Of the difference between the spline in use and Akima's curve through the same points; 0 with a smoothing.
    pub ambiguity: f64,
}

/// Roughness of a profile at the contact `middle ± half` (mm along it), with the contact modulus in MPa.
#[must_use]
pub fn roughness(points: Points, smoothing: f64, contact: [f64; 2], modulus: f64) -> Roughness {
    let [low, high] = contact;
    let half = 0.5 * (high - low);
    let last = points.along.len() - 1;
    let window = [
        (low - half - BEYOND).max(points.along[0]),
        (high + half + BEYOND).min(points.along[last]),
    ];
    let reference = REFERENCE_MIN.max(2.0 * smoothing);
    let part = points.within([
        window[0] - SUPPORT * reference,
        window[1] + SUPPORT * reference,
    ]);
    let step = STEP.max((window[1] - window[0]) / SAMPLES_MAX as f64);
    let count = ((window[1] - window[0]) / step).floor() as usize + 1;
    let places: Vec<f64> = (0..count).map(|k| window[0] + step * k as f64).collect();
    let used = Curve::smoothed(part, smoothing);
    let pressures = |other: &Curve| {
        let heights: Vec<f64> = places.iter().map(|s| used.above(other, *s)).collect();
        flattening(&heights, step, modulus)
    };
    let over_contact = |pressures: &[f64]| {
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for (_, pressure) in places
            .iter()
            .zip(pressures)
            .filter(|(s, _)| (low..=high).contains(*s))
        {
            sum += pressure * pressure;
            count += 1.0;
        }
        (sum / count.max(1.0)).sqrt()
    };
    let waves = pressures(&Curve::smoothed(part, reference));
    let mut sizes: Vec<f64> = waves.iter().map(|pressure| pressure.abs()).collect();
    Roughness {
        waviness: over_contact(&waves),
        everywhere: median(&mut sizes) / MEDIAN_OF_NORMAL,
        ambiguity: if smoothing > 0.0 {
            0.0
        } else {
            over_contact(&pressures(&Curve::Akima(Akima::new(part))))
        },
    }
}

/// A curve through or near points.
enum Curve {
    Spline([Spline; 2]),
    Akima(Akima),
}

impl Curve {
    fn smoothed(points: Points, cut: f64) -> Curve {
        Curve::Spline([0, 1].map(|part| {
            let values: Vec<f64> = points.at.iter().map(|at| at[part]).collect();
            Spline::new(points.along, &values, cut)
        }))
    }

    fn at(&self, s: f64) -> [f64; 2] {
        match self {
            Curve::Spline([y, z]) => {
                let i = y.interval(s);
                [y.at_in(i, s).value, z.at_in(i, s).value]
            }
            Curve::Akima(curve) => curve.at(s),
        }
    }

    /// How far this spline lies above another curve, along its normal.
    fn above(&self, other: &Curve, s: f64) -> f64 {
        let Curve::Spline([y, z]) = self else {
            return 0.0;
        };
        let i = y.interval(s);
        let (y, z) = (y.at_in(i, s), z.at_in(i, s));
        let [other_y, other_z] = other.at(s);
        let length = y.slope.hypot(z.slope).max(f64::MIN_POSITIVE);
        (y.slope * (z.value - other_z) - z.slope * (y.value - other_y)) / length
    }
}

/// Akima's curve (Journal of the ACM 17, 1970): cubics whose slopes at the points follow the flatter side, so that it keeps to
/// the chords where a spline swings.
struct Akima {
    knots: Vec<f64>,
    values: Vec<[f64; 2]>,
    slopes: Vec<[f64; 2]>,
}

impl Akima {
    fn new(points: Points) -> Akima {
        let slopes = [0, 1].map(|part| slopes(points, part));
        Akima {
            knots: points.along.to_vec(),
            values: points.at.to_vec(),
            slopes: slopes[0]
                .iter()
                .zip(&slopes[1])
                .map(|(y, z)| [*y, *z])
                .collect(),
        }
    }

    fn at(&self, s: f64) -> [f64; 2] {
        let after = self.knots.partition_point(|knot| *knot <= s);
        let i = after.clamp(1, self.knots.len() - 1) - 1;
        let step = self.knots[i + 1] - self.knots[i];
        let t = (s - self.knots[i]) / step;
        [0, 1].map(|part| {
            let (a, b) = (self.values[i][part], self.values[i + 1][part]);
            let (from, to) = (self.slopes[i][part], self.slopes[i + 1][part]);
            let chord = (b - a) / step;
            let bend = 3.0 * chord - 2.0 * from - to;
            let twist = from + to - 2.0 * chord;
            a + step * t * (from + t * (bend + t * twist))
        })
    }
}

/// Akima's slopes of one coordinate at the points.
fn slopes(points: Points, part: usize) -> Vec<f64> {
    let count = points.at.len();
    let mut chords = vec![0.0; count + 3];
    for k in 0..count - 1 {
        chords[k + 2] =
            (points.at[k + 1][part] - points.at[k][part]) / (points.along[k + 1] - points.along[k]);
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
