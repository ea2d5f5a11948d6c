//! Quality of the points of a profile: noise, outliers, steps, polygons, rounding, roughness under a contact, and the smoothing that the
//! noise requires.
//!
//! Noise and displaced points are found with one statistic, the fourth divided difference of five neighbours, which vanishes for every cubic.
//! Roughness is found by comparing two curves through the same points: the spline in use with a smoother one, and with Akima's curve.

use std::f64::consts::PI;

use crate::geometry::plane_curve::{CurvePoint, PlaneCurve, chords, is_corner, turn};
use crate::numerics::lu::first_coefficient;

/// Points on either side of the one whose fourth divided difference is taken.
const SIDE: usize = 2;
/// Largest length of five points in mm. The shape over longer stretches is not a cubic.
const SPAN_MAX: f64 = 12.0;
/// Fewest fourth differences for a quartile.
const DIFFERENCES_MIN: usize = 12;
/// Lower quartile of the absolute value of a standard normal variable.
const QUARTILE_OF_NORMAL: f64 = 0.3186;
/// Largest noise in mm that the shape of sound profiles simulates if points are 1 mm apart. It grows with the fourth power of the spacing.
/// Population: sound rails and wheels with true points 0.8 to 4 mm apart show 0.002 to 0.1 µm at 1 mm.
const COARSE_SHAPE: f64 = 6e-5;
/// Spacing in mm up to which the shape of sound profiles simulates less than 0.2 µm of noise, or 1 % of a usual pressure; same population.
const SHAPE_NEGLIGIBLE_SPACING: f64 = 1.8;
/// Least fourth difference of a displaced point, as a multiple of the noise. White noise exceeds it once in 10¹¹ points.
const DISPLACED: f64 = 7.0;
/// Least fourth difference of a displaced point per square of the spacing, in 1/mm. A jump of the curvature by 0.27/mm causes as much, while
/// the arcs of 13 and 20 mm at root and face of a flange differ by 0.13/mm.
const DISPLACED_BEND: f64 = 0.02;
/// Least deviation of a point of a group, relative to the largest one of the group.
const GROUP_SHARE: f64 = 0.3;
/// Most points of a group. Larger groups are waves.
const GROUP_POINTS_MAX: usize = 12;
/// Fewest kinks of a polygon.
const KINKS_MIN: usize = 4;
/// Most decimals of a coordinate that are looked for. Further ones come from the arithmetic of a reader.
const DIGITS_MAX: i32 = 9;

/// A defect of one or a few neighbouring points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LocalDefect {
    /// Points off the curve through their neighbours.
    Outliers {
        /// Index of the first and of the last one.
        points: [usize; 2],
        /// Number of displaced points among these.
        count: usize,
        /// Index of the one displaced most.
        farthest: usize,
        /// Its distance from the cubic through the sound points on both sides, in mm.
        distance: f64,
    },
    /// A jump of the profile between two points.
    Step {
        /// Index of the point before the jump.
        point: usize,
        /// Height in mm, positive upward.
        height: f64,
    },
}

impl LocalDefect {
    /// Displacement of a point in mm.
    fn size(&self) -> f64 {
        match self {
            LocalDefect::Outliers { distance, .. } => *distance,
            LocalDefect::Step { height, .. } => 0.5 * height.abs(),
        }
    }
}

/// Standard deviation in mm of white noise along the normal in a range of points. Returns `None` if the points are too few, too far apart, or
/// show no more than the shape of a sound profile with such coarse points.
///
/// The fourth divided difference of five neighbours, `Σ w_i h_i` with `w_i = 1/Π_{j≠i}(t_i − t_j)` and `Σ w_i² = 1`, vanishes for every
/// cubic, and for white noise of deviation s it has the deviation s. The lower quartile of its magnitude divided by 0.3186 is therefore s,
/// unaffected by displaced points and, if points are coarse, by the junctions of arcs. Correlated noise, as left by an instrument that
/// filters, is not detected.
pub fn noise(points: Points, range: [usize; 2]) -> Option<f64> {
    let inner = range[0] + SIDE..range[1].saturating_sub(SIDE);
    let mut length = 0.0;
    let mut sizes: Vec<f64> = inner
        .filter_map(|k| fourth_difference(points, k))
        .map(|(span, difference)| {
            length += span;
            difference.abs()
        })
        .collect();
    if sizes.len() < DIFFERENCES_MIN {
        return None;
    }
    let spacing = length / (2 * SIDE * sizes.len()) as f64;
    let quarter = sizes.len() / 4;
    let found = *sizes.select_nth_unstable_by(quarter, f64::total_cmp).1 / QUARTILE_OF_NORMAL;
    (spacing <= SHAPE_NEGLIGIBLE_SPACING || found > COARSE_SHAPE * spacing.powi(4)).then_some(found)
}

/// Length in mm of the chord over five points, and the normalised fourth divided difference in mm at the middle one. Returns `None` if there
/// are fewer points, or if they are too far apart.
fn fourth_difference(points: Points, k: usize) -> Option<(f64, f64)> {
    let window: &[[f64; 2]; 2 * SIDE + 1] = points.at.get(k.checked_sub(SIDE)?..)?.first_chunk()?;
    let (to_chord, span) = chord_axes(window);
    let local = window.map(|at| to_chord(&at));
    let weights: [f64; 2 * SIDE + 1] = std::array::from_fn(|i| {
        let others = (0..=2 * SIDE).filter(|j| *j != i);
        1.0 / others
            .map(|j| (local[i][0] - local[j][0]) / span)
            .product::<f64>()
    });
    let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let sum: f64 = weights.iter().zip(&local).map(|(w, at)| w * at[1]).sum();
    let difference = sum / length;
    (span <= SPAN_MAX && difference.is_finite()).then_some((span, difference))
}

/// The largest defect of a few points in a range.
///
/// A point is suspect if its fourth difference is the largest nearby, exceeds 7 times the noise in mm, and exceeds what a jump of the
/// curvature causes at such a spacing. A displaced point also changes the fourth differences of its neighbours, and several displaced points
/// disturb each other. The neighbours with similar differences are therefore compared, as a group, with the cubic through the sound points on
/// both sides of them. If that cubic plus a step between two points fits all of them, the defect is a step.
pub fn local_defect(points: Points, range: [usize; 2], noise: f64) -> Option<LocalDefect> {
    let last = points.at.len() - 1;
    let size = |k: usize| {
        let has_corner = || (k - 1..=k + 1).any(|at| is_corner(points.at, at));
        let found = fourth_difference(points, k).filter(|_| !has_corner());
        found.map_or(0.0, |(_, difference)| difference.abs())
    };
    let mut worst: Option<LocalDefect> = None;
    for here in range[0]..range[1] {
        let own = size(here);
        let near = || here.saturating_sub(SIDE)..=(here + SIDE).min(last);
        let chords = here.saturating_sub(SIDE)..(here + SIDE).min(last);
        let longest = chords.map(|k| points.chord(k)).fold(0.0, f64::max);
        let least = (DISPLACED * noise).max(DISPLACED_BEND * longest * longest);
        if own <= least || near().any(|k| size(k) > own) {
            continue;
        }
        let belongs = |k: &usize| size(*k) > GROUP_SHARE * own;
        let first = (0..=here).rev().take_while(belongs).last().unwrap_or(here);
        let last = (here..=last).take_while(belongs).last().unwrap_or(here);
        let found = group_defect(points, [first, last]);
        if let Some(found) = found
            && worst.is_none_or(|known| found.size() > known.size())
        {
            worst = Some(found);
        }
    }
    worst
}

/// The defect of a group of points from the first to the last one; `None` if there are too many.
fn group_defect(points: Points, [first, last]: [usize; 2]) -> Option<LocalDefect> {
    if last + 1 - first > GROUP_POINTS_MAX {
        return None;
    }
    let from = first.saturating_sub(2 * SIDE);
    let to = (last + 2 * SIDE + 1).min(points.at.len());
    let (to_chord, length) = chord_axes(&points.at[from..to]);
    let local: Vec<[f64; 2]> = points.at[from..to].iter().map(to_chord).collect();
    let inside = |k: usize| (first..=last).contains(&(from + k));
    let off = |k: usize| {
        let sound = local.iter().enumerate().filter(|(j, _)| !inside(*j));
        above_cubic(local[k], sound.map(|(_, at)| *at), length)
    };
    let deviations: Option<Vec<f64>> = (first - from..=last - from).map(off).collect();
    let deviations = deviations?;
    let largest = deviations
        .iter()
        .fold(0.0_f64, |most, off| most.max(off.abs()));
    // A step after each point of the group is tried.
    let steps = (first.saturating_sub(1).max(from)..=last).filter_map(|point| {
        let [height, left] = step_after(&local, point - from, length)?;
        Some((point, height, left))
    });
    let best = steps.min_by(|a, b| a.2.total_cmp(&b.2));
    if let Some((point, height, left)) = best
        && left < GROUP_SHARE * largest
        && left < GROUP_SHARE * height.abs()
    {
        return Some(LocalDefect::Step { point, height });
    }
    let is_off = |k: &usize| deviations[*k].abs() > GROUP_SHARE * largest;
    let displaced: Vec<usize> = (0..deviations.len()).filter(is_off).collect();
    let farthest = (0..deviations.len())
        .max_by(|a, b| deviations[*a].abs().total_cmp(&deviations[*b].abs()))?;
    Some(LocalDefect::Outliers {
        points: [first + displaced[0], first + displaced[displaced.len() - 1]],
        count: displaced.len(),
        farthest: first + farthest,
        distance: largest,
    })
}

/// Fits a cubic with a step after a point. Returns the height of the step and the largest distance of a point from this fit, both in mm.
fn step_after(local: &[[f64; 2]], point: usize, length: f64) -> Option<[f64; 2]> {
    let after = |k: usize| if k > point { 1.0 } else { 0.0 };
    let middle = 0.5 * length;
    // The height of the step is the first coefficient.
    let rows: Vec<([f64; 5], f64)> = (local.iter().enumerate())
        .map(|(k, at)| {
            let x = (at[0] - middle) / length;
            ([after(k), 1.0, x, x * x, x * x * x], at[1])
        })
        .collect();
    let height = first_coefficient(&rows)?;
    let lowered = local.iter().enumerate();
    let lowered: Vec<[f64; 2]> = lowered
        .map(|(k, at)| [at[0], at[1] - height * after(k)])
        .collect();
    let left = |at: &[f64; 2]| above_cubic(*at, lowered.iter().copied(), length).map(f64::abs);
    let left: Option<Vec<f64>> = lowered.iter().map(left).collect();
    Some([height, left?.into_iter().fold(0.0, f64::max)])
}

/// Height of a point `[t, h]` above the least-squares cubic through others. `scale` is a length of the size of their distances.
fn above_cubic(
    [t, h]: [f64; 2],
    others: impl Iterator<Item = [f64; 2]>,
    scale: f64,
) -> Option<f64> {
    let powers = |at: [f64; 2]| {
        let x = (at[0] - t) / scale;
        ([1.0, x, x * x, x * x * x], at[1])
    };
    Some(h - first_coefficient(&others.map(powers).collect::<Vec<_>>())?)
}

/// Median length in mm of the sides of the polygon on which the points of a range lie, if they were interpolated linearly between fewer
/// points.
///
/// Such points lie on straight lines to the digits with which they are given. They turn at the corners, or at the two points next to a corner
/// if no point lies on it. `digits` is the step in mm of which all coordinates are multiples. It moves a point by up to `digits/√2` and
/// changes a turn by up to `√2 digits (1/a + 1/b)` between chords of lengths a and b. A kink turns by more than three times this, and the
/// points on both sides turn by no more than this. A smooth curve cannot do both.
pub fn polygon(points: Points, range: [usize; 2], digits: f64) -> Option<f64> {
    let bound = |k: usize| {
        let [before, after] = [points.chord(k - 1), points.chord(k)];
        2.0_f64.sqrt() * digits * (1.0 / before + 1.0 / after)
    };
    let last = range[1].min(points.at.len()).saturating_sub(1);
    let (mut kinks, mut others): (Vec<f64>, usize) = (Vec::new(), 0);
    // The points after the last straight one.
    let mut open: Option<Vec<usize>> = None;
    for k in range[0].max(1)..last {
        let turned = turn(points.at, k);
        if turned.abs() <= bound(k) {
            match open.replace(Vec::new()).as_deref() {
                Some([at]) => kinks.push(points.along[*at]),
                Some([at, _]) => kinks.push(points.along[*at] + 0.5 * points.chord(*at)),
                Some([]) | None => {}
                Some(_) => others += 1,
            }
        } else if turned.abs() > 3.0 * bound(k) {
            if let Some(open) = &mut open {
                open.push(k);
            }
        } else {
            open = None;
        }
    }
    if kinks.len() < KINKS_MIN.max(others) {
        return None;
    }
    let chords = kinks.windows(2).map(|pair| pair[1] - pair[0]);
    Some(median(&mut chords.collect::<Vec<f64>>()))
}

/// The largest power of ten in mm, from 1e-9 to 0.1, of which all coordinates in one direction are multiples: 0 for y, 1 for z.
pub fn decimal_step(given: &[[f64; 2]], part: usize) -> f64 {
    let all_are_multiples = |step: &f64| {
        given.iter().all(|at| {
            let steps = at[part] / step;
            (steps - steps.round()).abs() < 1e-4
        })
    };
    let mut steps = (1..=DIGITS_MAX).map(|digits| 10.0_f64.powi(-digits));
    let found = steps.find(all_are_multiples);
    found.unwrap_or(10.0_f64.powi(-DIGITS_MAX))
}

/// Axes along and perpendicular to the chord from the first to the last point, and its length.
fn chord_axes(window: &[[f64; 2]]) -> (impl Fn(&[f64; 2]) -> [f64; 2] + use<>, f64) {
    let (from, to) = (window[0], window[window.len() - 1]);
    let chord = [to[0] - from[0], to[1] - from[1]];
    let length = chord[0].hypot(chord[1]).max(f64::MIN_POSITIVE);
    let axis = chord.map(|part| part / length);
    let to_chord = move |at: &[f64; 2]| {
        let [y, z] = [at[0] - from[0], at[1] - from[1]];
        [axis[0] * y + axis[1] * z, axis[0] * z - axis[1] * y]
    };
    (to_chord, length)
}

/// The median, or 0 for an empty list.
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Least length in mm of a long chord. The arcs of heads and treads are 10 to 50 mm long.
pub(crate) const LONG: f64 = 10.0;
/// Least length of a long chord relative to the median chord. Neighbouring points are one or two chords apart.
pub(crate) const LONG_MEDIANS: f64 = 8.0;
/// Most points at an end beyond a long chord that are dropped.
const STRAY_POINTS_MAX: usize = 2;

/// The length in mm from which a chord is long against the others: it joins parts that do not belong together, or spans a hole.
pub(crate) fn long_chord(points: &[[f64; 2]]) -> f64 {
    let mut chords: Vec<f64> = chords(points).collect();
    LONG.max(LONG_MEDIANS * median(&mut chords))
}

/// The points beyond a long chord at the first and at the last end: their number, and the length of the chord in mm.
pub fn stray_ends(points: &[[f64; 2]]) -> [Option<(usize, f64)>; 2] {
    let long = long_chord(points);
    let farthest = |from_end: &mut dyn Iterator<Item = f64>| {
        let near = (1..).zip(from_end).take(STRAY_POINTS_MAX);
        near.filter(|(_, chord)| *chord > long).last()
    };
    let chords: Vec<f64> = chords(points).collect();
    [
        farthest(&mut chords.iter().copied()),
        farthest(&mut chords.iter().rev().copied()),
    ]
}

/// Points of a profile with their distance along it, both in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Points<'a> {
    /// `[y, z]` in mm, z up.
    pub at: &'a [[f64; 2]],
    /// Length of the chain from the first point to each point.
    pub along: &'a [f64],
}

impl Points<'_> {
    /// Indices of the points in a range of the length: the first one, and one past the last one.
    pub fn numbers(&self, range: [f64; 2]) -> [usize; 2] {
        let first = self.along.partition_point(|s| *s < range[0]);
        let last = self.along.partition_point(|s| *s <= range[1]);
        [first, last.max(first)]
    }

    /// Length of the chord from a point to the next.
    pub(crate) fn chord(&self, k: usize) -> f64 {
        self.along[k + 1] - self.along[k]
    }
}

/// Spacing in mm at which curves are compared. It resolves a cubic between two points of usual profiles.
pub(crate) const STEP: f64 = 0.1;
/// Distance in mm by which the comparison and the noise estimate extend beyond twice the half width of the contact.
const BEYOND: f64 = 10.0;
/// Least smoothing of the reference curve in mm. Otherwise it is twice the smoothing in use. A point affects the reference up to this
/// distance.
pub const REFERENCE_MIN: f64 = 3.0;

/// Roughness under a contact, as pressures in MPa that flatten it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Roughness {
    /// Root mean square over the contact of the waves between the smoothing in use and twice that, at least 3 mm.
    pub waviness: f64,
    /// Root mean square of the difference between the spline in use and Akima's curve through the same points; 0 with smoothing.
    pub ambiguity: f64,
}

/// The points of a profile and the curve in use.
#[derive(Debug, Clone, Copy)]
pub struct PointsRead<'a> {
    /// The points.
    pub points: Points<'a>,
    /// The curve through them, or near them if it is smoothed.
    pub curve: &'a PlaneCurve,
    /// Cut wavelength of its smoothing in mm; 0 for none.
    pub smoothing: f64,
    /// Step in mm of which all coordinates are multiples.
    pub digits: f64,
    /// Step in mm of which all heights are multiples, if it is at least 0.001 mm.
    pub rounding: Option<f64>,
}

impl PointsRead<'_> {
    /// Standard deviation in mm of the noise along the normal in a range of points; see [`noise`]. Rounded heights have at least the noise of
    /// the rounding, because neighbours are equal where a profile is level.
    pub fn noise(&self, range: [usize; 2]) -> Option<f64> {
        let least = rounding_error(self.rounding.unwrap_or(0.0));
        Some(noise(self.points, range)?.max(least))
    }
}

/// Standard deviation of the error by rounding to multiples of a step. Noise up to twice this is due to the rounding.
fn rounding_error(step: f64) -> f64 {
    step / 12.0_f64.sqrt()
}

/// Roughness at the contact `[low, high]`, in mm along the profile, from the curves there and next to it. The contact modulus is in MPa.
fn roughness(reading: &PointsRead, [low, high]: [f64; 2], modulus: f64) -> Roughness {
    let PointsRead {
        points,
        curve,
        smoothing,
        ..
    } = *reading;
    let beyond = 0.5 * (high - low) + BEYOND;
    let first = (low - beyond).max(points.along[0]);
    let last = (high + beyond).min(points.along[points.along.len() - 1]);
    let reference = REFERENCE_MIN.max(2.0 * smoothing);
    let count = ((last - first) / STEP).floor() as usize + 1;
    let places: Vec<f64> = (0..count).map(|k| first + STEP * k as f64).collect();
    let used: Vec<CurvePoint> = places.iter().map(|s| curve.at(*s)).collect();
    let inside = places.partition_point(|s| *s < low)..places.partition_point(|s| *s <= high);
    let pressure = |other: &PlaneCurve| {
        let differences = used.iter().zip(&places);
        let heights: Vec<f64> = differences
            .map(|(used, s)| above(used, other.position(*s)))
            .collect();
        let squares = inside.clone().map(|k| flattening(&heights, k).powi(2));
        modulus * (squares.sum::<f64>() / inside.len().max(1) as f64).sqrt()
    };
    Roughness {
        waviness: pressure(&PlaneCurve::through(points.at, points.along, reference)),
        ambiguity: match smoothing > 0.0 {
            true => 0.0,
            false => pressure(&PlaneCurve::akima(points.at, points.along)),
        },
    }
}

/// Distance along the normal from a point of a curve to a point of another curve; positive if the first curve is above.
fn above(used: &CurvePoint, other: [f64; 2]) -> f64 {
    let tangent = used.tangent();
    tangent[0] * (used.at[1] - other[1]) - tangent[1] * (used.at[0] - other[0])
}

/// Pressure at one of evenly spaced places that flattens `heights` in mm, relative to the contact modulus.
///
/// A wave `r` of the wavenumber k needs the pressure `E* |k| r / 2`. For samples a distance h apart, `|k|` is the sum with the weights `π/(2h)`
/// at the place itself and `−2/(π m² h)` at the odd distances m.
fn flattening(heights: &[f64], at: usize) -> f64 {
    let odd = |(k, height): (usize, &f64)| {
        let distance = k.abs_diff(at);
        let is_odd = distance % 2 == 1;
        is_odd.then(|| height / (distance * distance) as f64)
    };
    let others: f64 = heights.iter().enumerate().filter_map(odd).sum();
    0.5 * (0.5 * PI * heights[at] - 2.0 / PI * others) / STEP
}

/// Standard deviation in MPa of the pressure that white noise leaves after a smoothing that halves waves of `cut` mm. The noise has the
/// standard deviation `noise` in mm at points `spacing` mm apart.
///
/// The value `2.34 E* s √(h/L³)` follows from `2 (π E*)² s² h / L³ · ∫ x²/(1+x⁴)² dx` with the integral `π√2/16`.
pub fn noise_pressure(modulus: f64, noise: f64, spacing: f64, cut: f64) -> f64 {
    2.34 * modulus * noise * (spacing / cut.powi(3)).sqrt()
}

/// Range of advised smoothing lengths in mm. Shorter ones do not remove the noise of neighbouring points. Longer ones distort gauge corners and
/// flange roots with radii of 13 to 20 mm: 5 mm changes the largest pressure by 2 %, 10 mm by 27 % in one of ten cases.
pub const SMOOTHING_ADVISED: [f64; 2] = [2.0, 8.0];
/// Noise that remains after the advised smoothing, as a share of the largest pressure; no smoothing is advised if there is no more without
/// one. Between 0.05 and 0.1 neither pressures nor forces change by more than their scatter. Population: 18 positions on three pairs with
/// noise of 1 to 20 µm.
const NOISE_LEFT: f64 = 0.07;
/// Smoothing length, in chords, that turns a polygon into a smooth curve. A shorter one does not change coarse points.
pub(crate) const CHORDS: f64 = 2.0;
/// Largest ratio of the waviness to the noise that explains it. Estimates from few points scatter by a factor of 2.
const EXPLAINED: f64 = 3.0;

/// Quality of the points of one body under one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnderContact {
    /// The longest chord that overlaps the contact, as its ends along the profile in mm.
    pub chord: [f64; 2],
    /// Length of this chord relative to the width of the contact.
    pub over_width: f64,
    /// Mean spacing of the points around the contact, in mm.
    pub spacing: f64,
    /// Standard deviation of the noise along the normal in mm, if there are enough points to determine it.
    pub noise: Option<f64>,
    /// Waviness and ambiguity, as pressures.
    pub roughness: Roughness,
    /// Length of the sides in mm, if the points lie on a polygon.
    pub polygon: Option<f64>,
    /// The largest defect of a few points near the contact.
    pub local_defect: Option<LocalDefect>,
    /// Whether noise or rounding explains the waviness.
    pub noisy: bool,
    /// Step in mm to which the heights were rounded, if the noise is due to it.
    pub rounding: Option<f64>,
}

/// Quality of the points of a body under the contact `[low, high]` (mm along the profile); the contact modulus is in MPa.
pub fn under_contact(reading: &PointsRead, contact: [f64; 2], modulus: f64) -> UnderContact {
    let points = reading.points;
    let [low, high] = contact;
    let half = 0.5 * (high - low);
    let last_chord = points.at.len() - 2;
    let first = points.along.partition_point(|s| *s <= low).max(1) - 1;
    let last = points.along.partition_point(|s| *s < high).max(1) - 1;
    let widest = (first..=last.min(last_chord))
        .max_by(|a, b| points.chord(*a).total_cmp(&points.chord(*b)))
        .unwrap_or(first.min(last_chord));
    let wide = [low - half - BEYOND, high + half + BEYOND];
    let around = points.numbers(wide);
    let count = around[1] - around[0];
    let spacing = if count > 1 {
        (points.along[around[1] - 1] - points.along[around[0]]) / (count - 1) as f64
    } else {
        points.chord(widest)
    };
    let near = half.max(REFERENCE_MIN);
    let near = points.numbers([low - near, high + near]);
    let noise = (reading.noise(around)).or_else(|| reading.noise([0, points.at.len()]));
    let roughness = roughness(reading, contact, modulus);
    let rounding = reading.rounding;
    let rounding =
        rounding.filter(|step| noise.is_some_and(|noise| noise <= 2.0 * rounding_error(*step)));
    let cut = reading.smoothing.max(2.0 * spacing);
    let explained = noise_pressure(modulus, noise.unwrap_or(0.0), spacing, cut);
    UnderContact {
        chord: [points.along[widest], points.along[widest + 1]],
        over_width: points.chord(widest) / (high - low),
        spacing,
        noise,
        roughness,
        polygon: polygon(points, around, reading.digits),
        local_defect: local_defect(points, near, noise.unwrap_or(0.0)),
        noisy: roughness.waviness <= EXPLAINED * explained,
        rounding,
    }
}

/// Noise and spacing of the points of one body, in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NoiseLevel {
    /// Standard deviation of the noise along the normal.
    pub noise: f64,
    /// Mean spacing of the points.
    pub spacing: f64,
    /// Length of the sides, if the points lie on a polygon.
    pub polygon: Option<f64>,
}

/// The smoothing advised for each of two bodies, in mm, given the largest pressure and the contact modulus in MPa; 0 if none is needed.
///
/// `L = (2.34 E* √(s₁² h₁ + s₂² h₂) / (0.07 p))^(2/3)` leaves noise of 7 % of the pressure (see [`noise_pressure`]). It is limited to 2 to
/// 8 mm. A body whose own noise without smoothing is below that is not smoothed. A polygon is smoothed by at least two
/// sides.
pub fn advised_smoothing(bodies: [NoiseLevel; 2], modulus: f64, pressure: f64) -> [f64; 2] {
    let share = |body: &NoiseLevel| body.noise * body.spacing.sqrt();
    let both = share(&bodies[0]).hypot(share(&bodies[1]));
    let [least, most] = SMOOTHING_ADVISED;
    let unsmoothed = noise_pressure(modulus, both, 1.0, 1.0);
    let length = (unsmoothed / (NOISE_LEFT * pressure)).powf(2.0 / 3.0);
    bodies.map(|body| {
        let raw = noise_pressure(modulus, body.noise, body.spacing, 2.0 * body.spacing);
        let of_noise = if raw < NOISE_LEFT * pressure {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::plane_curve::arc_lengths;

    /// Applies `of` to all points.
    fn with<T>(at: &[[f64; 2]], of: impl Fn(Points, [usize; 2]) -> T) -> T {
        let along = arc_lengths(at);
        let points = Points { at, along: &along };
        of(points, [0, at.len()])
    }

    fn defect(points: Points, range: [usize; 2]) -> Option<LocalDefect> {
        local_defect(points, range, noise(points, range).unwrap_or(0.0))
    }

    /// Points of a circle of 80 mm every 0.3 mm.
    fn arc(count: u32) -> Vec<[f64; 2]> {
        let angle = |k: u32| 0.3 / 80.0 * (f64::from(k) - 0.5 * f64::from(count));
        (0..count)
            .map(|k| [80.0 * angle(k).sin(), 80.0 * angle(k).cos()])
            .collect()
    }

    /// Standard normal numbers: sums of twelve uniform ones of a linear congruential generator (Knuth's MMIX).
    fn normal(count: usize) -> Vec<f64> {
        let mut state = 7_u64;
        let mut even = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count)
            .map(|_| (0..12).map(|_| even()).sum::<f64>() - 6.0)
            .collect()
    }

    #[test]
    fn the_noise_found_is_the_deviation_that_was_added_on_a_line_and_on_an_arc() {
        for deviation in [0.0005, 0.005, 0.02] {
            let mut points = arc(400);
            for (at, noise) in points.iter_mut().zip(normal(400)) {
                at[1] += deviation * noise;
            }
            let found = with(&points, noise).expect("enough points");
            assert!(
                (found / deviation - 1.0).abs() < 0.15,
                "{deviation}: {found}"
            );
        }
        let clean = with(&arc(400), noise).expect("enough points");
        assert!(clean < 1e-7, "{clean}");
        assert_eq!(with(&arc(8), noise), None, "too few to tell");
    }

    #[test]
    fn coarse_points_tell_noise_that_is_more_than_what_their_shape_looks_like() {
        let every = |step: usize| arc(400).into_iter().step_by(step);
        let mut noisy: Vec<[f64; 2]> = every(6).collect();
        let numbers = normal(noisy.len());
        noisy
            .iter_mut()
            .zip(&numbers)
            .for_each(|(at, n)| at[1] += 0.005 * n);
        let found = with(&noisy, noise).expect("1.8 mm tell 5 µm");
        assert!((found / 0.005 - 1.0).abs() < 0.5, "{found}");
        let clean: Vec<[f64; 2]> = every(10).collect();
        assert_eq!(with(&clean, noise), None, "3 mm and no noise");
    }

    #[test]
    fn one_point_off_is_an_outlier_of_its_distance_and_not_noise() {
        let mut points = arc(200);
        points[90][1] += 0.02;
        let Some(LocalDefect::Outliers {
            points: [90, 90],
            count: 1,
            farthest: 90,
            distance,
        }) = with(&points, defect)
        else {
            panic!("{:?}", with(&points, defect))
        };
        assert!((distance / 0.02 - 1.0).abs() < 0.01, "{distance}");
        assert!(with(&points, noise).expect("enough points") < 1e-6);
    }

    #[test]
    fn few_points_off_are_found_together_whatever_their_signs() {
        for signs in [vec![1.0, -1.0], vec![-1.0, 1.0, -1.0, 1.0], vec![1.0, 1.0]] {
            for noisy in [0.0, 0.0005] {
                let mut points = arc(200);
                for (at, noise) in points.iter_mut().zip(normal(200)) {
                    at[1] += noisy * noise;
                }
                for (at, sign) in points[90..].iter_mut().zip(&signs) {
                    at[1] += 0.03 * sign;
                }
                let found = with(&points, defect);
                let Some(LocalDefect::Outliers {
                    points: [first, last],
                    count,
                    distance,
                    ..
                }) = found
                else {
                    panic!("{signs:?}: {found:?}")
                };
                assert_eq!([first, last], [90, 89 + signs.len()], "{signs:?}");
                assert_eq!(count, signs.len());
                assert!((distance / 0.03 - 1.0).abs() < 0.2, "{signs:?}: {distance}");
            }
        }
    }

    #[test]
    fn a_jump_between_two_points_is_a_step_of_its_height() {
        let mut points = arc(200);
        points.iter_mut().skip(101).for_each(|at| at[1] -= 0.03);
        let Some(LocalDefect::Step { point, height }) = with(&points, defect) else {
            panic!("{:?}", with(&points, defect))
        };
        assert_eq!(point, 100);
        assert!((height / -0.03 - 1.0).abs() < 0.05, "{height}");
    }

    #[test]
    fn points_on_chords_are_a_polygon_wherever_they_lie_on_them() {
        for step in [4, 8, 16] {
            let corners: Vec<[f64; 2]> = arc(600).into_iter().step_by(step).collect();
            let length = 0.3 * step as f64;
            for spacing in [0.1, 0.23, 0.31] {
                let along = |k: u32| 0.07 + spacing * f64::from(k);
                let places = (0..).map(along);
                let last = length * (corners.len() - 1) as f64;
                let points: Vec<[f64; 2]> = places
                    .take_while(|s| *s < last)
                    .map(|s| {
                        let k = (s / length) as usize;
                        let t = s / length - k as f64;
                        [0, 1].map(|part| {
                            corners[k][part] + t * (corners[k + 1][part] - corners[k][part])
                        })
                    })
                    .collect();
                let rounded = |step: f64| -> Vec<[f64; 2]> {
                    let round = |part: f64| (part / step).round() * step;
                    points.iter().map(|at| at.map(round)).collect()
                };
                for (points, digits) in [(points.clone(), 1e-9), (rounded(1e-5), 1e-5)] {
                    let found = with(&points, |points, range| polygon(points, range, digits));
                    let chord = found.unwrap_or_else(|| panic!("{length} {spacing} {digits}"));
                    assert!((chord / length - 1.0).abs() < 0.1, "{length}: {chord}");
                }
            }
        }
    }

    #[test]
    fn smooth_rounded_and_noisy_points_are_no_polygon() {
        for step in [1e-9, 1e-5, 1e-4, 1e-3, 1e-2] {
            let round = |part: f64| (part / step).round() * step;
            for noisy in [0.0, 1e-4, 1e-3, 1e-2] {
                let mut points = arc(400);
                for (at, noise) in points.iter_mut().zip(normal(400)) {
                    at[1] += noisy * noise;
                    *at = at.map(round);
                }
                let found = with(&points, |points, range| polygon(points, range, step));
                assert_eq!(found, None, "{step} {noisy}");
            }
        }
    }

    #[test]
    fn the_decimal_step_is_the_coarsest_of_all_coordinates() {
        assert_eq!(decimal_step(&[[0.0, 1.2], [1.0, 3.4]], 1), 0.1);
        assert_eq!(decimal_step(&[[0.25, 1.2], [1.0, 3.45]], 0), 0.01);
        assert_eq!(decimal_step(&[[0.0, 1.2345], [1.0, 3.45]], 1), 1e-4);
        assert_eq!(decimal_step(&[[1.0 / 3.0, 0.0], [1.0, 3.45]], 0), 1e-9);
    }

    /// A head of 70 mm, z up: flat on top with a fall of `y²/600`, sides that fall steeply.
    fn head() -> Vec<[f64; 2]> {
        (-350..=350)
            .map(|k| 0.1 * f64::from(k))
            .map(|y: f64| [y, -y * y / 600.0 - 3.0 * (y.abs() - 30.0).max(0.0)])
            .collect()
    }

    #[test]
    fn a_point_far_beyond_the_last_one_is_stray_and_even_points_are_not() {
        let mut points = head();
        assert_eq!(stray_ends(&points), [None, None]);
        points.push([95.0, -40.0]);
        let [first, last] = stray_ends(&points);
        assert_eq!(first, None);
        let (count, length) = last.expect("a stray point");
        assert_eq!(count, 1);
        assert!(length > 50.0, "{length}");
    }
}

#[cfg(test)]
mod readings_tests {
    use std::f64::consts::TAU;

    use super::*;

    const MODULUS: f64 = 115_000.0;
    const CONTACT: [f64; 2] = [25.0, 35.0];

    /// Points 0.25 mm apart on a circle of 300 mm radius, plus a height as a function of the length.
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
        roughness(&reading, CONTACT, MODULUS)
    }

    #[test]
    fn a_smooth_crown_is_not_rough_by_any_reading() {
        let found = of(0.0, |_| 0.0);
        assert!(found.waviness < 1.0, "{found:?}");
        assert!(found.ambiguity < 1.0, "{found:?}");
    }

    /// A spline that halves waves of 3 mm keeps the part `1/(1+(3/L)⁴)` of a wave of length L. The rest is detected.
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
