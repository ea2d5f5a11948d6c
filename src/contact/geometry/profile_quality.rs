//! Detects measurement artefacts in the points of a profile: noise, outliers, steps, polygons, rounding.
//!
//! The points of a profile with their distance along it.
//!
//! Compares two readings of the same points: the spline in use with a smoother one, and with Akima's curve.
//!
//! The quality of a profile under a contact, and the smoothing that its noise requires.

use std::cell::RefCell;
use std::f64::consts::{PI, TAU};

use realfft::RealFftPlanner;

use crate::geometry::plane_curve::{PlaneCurve, is_corner, turn};
use crate::numerics::lu::first_coefficient;

/// Chords in one window of the noise estimate.
const NOISE_CHORDS: usize = 4;
/// Largest length of a window in mm: over longer ones the shape itself differs from a cubic.
const NOISE_SPAN_MAX: f64 = 3.0;
/// Largest length of a window of coarse points in mm.
const COARSE_SPAN_MAX: f64 = 12.0;
/// Fewest windows for a median.
const WINDOWS_MIN: usize = 12;
/// Fewest windows of coarse points for a quartile.
const COARSE_WINDOWS_MIN: usize = 30;
/// Noise in mm that the quartile finds in the shape alone, for points 1 mm apart; it grows with the fourth power of their distance.
///
/// Population: sound rails and wheels of the class *damaged profile* with true points 0.8 to 4 mm apart: 0.002 to 0.1 µm at 1 mm, each of them
/// below this; noise of 1 µm at 1.7 mm, 3 µm at 2.5 mm is above it.
const COARSE_SHAPE: f64 = 6e-5;
/// Distance of the points in mm up to which the shape of sound profiles contributes less than 0.2 µm, or 1 % of a usual pressure.
const COARSE_TELLS: f64 = 1.8;
/// Lower quartile of the absolute value of a normal variable of deviation 1.
const QUARTILE_OF_NORMAL: f64 = 0.3186;
/// Median of the absolute value of a normal variable of deviation 1.
const MEDIAN_OF_NORMAL: f64 = 0.6745;
/// Deviation, in local medians, from which a point is an outlier. Population: seeded damage of the stress bench (class *damaged profile*);
/// an outlier of 2 µm may cause half of the largest pressure.
const ODD_MEDIANS: f64 = 12.0;
/// Deviation in mm from which a point is an outlier; same population.
const ODD_MIN: f64 = 1.2e-3;
/// Distance of the points in mm above which the threshold grows with its square, as do the deviations where the curvature jumps: between
/// arcs, and between the polynomials of a tread.
const ODD_SPACING: f64 = 0.25;
/// Points in a local median.
const ODD_WINDOW: usize = 15;
/// Longest stretch in mm over which a cubic is fitted to six neighbours.
const ODD_SPAN_MAX: f64 = 3.5;
/// Longest chord in a window of seven points, in mean chords: next to a hole the cubic says nothing.
const ODD_CHORD_MAX: f64 = 2.0;
/// Part of the largest deviation of a group from which a point belongs to it.
const ODD_PART: f64 = 0.3;
/// Most points in a group of displaced points, with those next to them; more are waves.
const ODD_POINTS_MAX: usize = 12;
/// Points on either side of a group that its deviations are measured from.
const ODD_SOUND: usize = 4;
/// Fewest kinks of a polygon.
const KINKS_MIN: usize = 4;
/// Least ratio of the sum of the turns at kinks to the sum of their magnitudes: a rail or a wheel bends to one side over many chords.
const KINKS_ONE_WAY: f64 = 0.8;
/// Most decimals that are looked for; with more the arithmetic of readers leaves none, and coordinates count as exact to the step after it.
const DIGITS_MAX: i32 = 7;
const DIGITS_LEAST: f64 = 1e-9;
/// Share of neighbouring fourth differences with opposite signs above which they are those of white noise, for which it is 0.8: their
/// correlation is −56/70. Of waves longer than four points it is 0.5 and less.
const WHITE: f64 = 0.65;

/// A defect of few points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Oddity {
    /// Points off the curve through their neighbours.
    Outliers {
        /// Index of the first and of the last one.
        points: [usize; 2],
        /// How many of these are off.
        count: usize,
        /// Index of the farthest one.
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

impl Oddity {
    /// How far a point is from where it belongs, in mm.
    fn size(&self) -> f64 {
        match self {
            Oddity::Outliers { distance, .. } => *distance,
            Oddity::Step { height, .. } => 0.5 * height.abs(),
        }
    }
}

/// Standard deviation in mm of white noise along the normal, over the points of a range; `None` if too few of them are close enough
/// together to determine it.
///
/// The fourth divided difference of five neighbours, `Σ w_i h_i` with `w_i = 1/Π_{j≠i}(t_i − t_j)` and `Σ w_i² = 1`, vanishes for every
/// cubic, and for white noise of deviation s it has the deviation s. The median of its magnitude divided by 0.6745 is therefore s,
/// unaffected by single outliers. (Correlated noise, as left by an instrument that filters, is not detected.)
///
/// For points more than 0.75 mm apart, half of the windows may contain the junction of two arcs. The lower quartile divided by 0.3186
/// is then used, if it exceeds the contribution of the shape.
pub fn noise(points: Points, range: [usize; 2]) -> Option<f64> {
    let (mut fine, mut coarse) = (Vec::new(), Vec::new());
    let mut length = 0.0;
    for k in range[0]..range[1].saturating_sub(NOISE_CHORDS) {
        let found = window_at(points, k).and_then(fourth_difference);
        let Some((span, difference)) = found else {
            continue;
        };
        if span <= NOISE_SPAN_MAX {
            fine.push(difference.abs());
        } else if span <= COARSE_SPAN_MAX {
            coarse.push(difference.abs());
            length += span;
        }
    }
    if fine.len() >= WINDOWS_MIN {
        return Some(median(&mut fine) / MEDIAN_OF_NORMAL);
    }
    if coarse.len() < COARSE_WINDOWS_MIN {
        return None;
    }
    let spacing = length / (NOISE_CHORDS * coarse.len()) as f64;
    coarse.sort_by(f64::total_cmp);
    let found = coarse[coarse.len() / 4] / QUARTILE_OF_NORMAL;
    // For points close enough together, the contribution of the shape is negligible.
    (spacing <= COARSE_TELLS || found > COARSE_SHAPE * spacing.powi(4)).then_some(found)
}

/// Whether the fourth differences of the points of a range are those of white noise, whose signs alternate, and not of waves.
pub fn is_white(points: Points, range: [usize; 2]) -> bool {
    let differences: Vec<f64> = (range[0]..range[1].saturating_sub(NOISE_CHORDS))
        .filter_map(|k| window_at(points, k).and_then(fourth_difference))
        .map(|(_, difference)| difference)
        .collect();
    let pairs = differences.windows(2);
    let opposite = pairs.clone().filter(|pair| pair[0] * pair[1] < 0.0);
    opposite.count() as f64 > WHITE * pairs.len() as f64
}

/// Length of the chord over five points in mm, and their normalised fourth divided difference in mm.
fn fourth_difference(window: &[[f64; 2]; NOISE_CHORDS + 1]) -> Option<(f64, f64)> {
    let local = in_chord(window);
    let span = local[NOISE_CHORDS][0] - local[0][0];
    let weights: [f64; NOISE_CHORDS + 1] = std::array::from_fn(|i| {
        let others = (0..=NOISE_CHORDS).filter(|j| *j != i);
        1.0 / others
            .map(|j| (local[i][0] - local[j][0]) / span)
            .product::<f64>()
    });
    let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let sum: f64 = weights.iter().zip(&local).map(|(w, at)| w * at[1]).sum();
    let difference = sum / length;
    (span > 0.0 && difference.is_finite()).then_some((span, difference))
}

/// The worst defect of few points in a range: points that deviate from the least-squares cubic of their six neighbours by more than 12 local
/// medians and by at least 1.2 µm (more where points are coarse), with those next to them that do so too.
///
/// A displaced point makes its neighbours deviate by 0.43 of its own displacement, and several displaced points disturb each other. The
/// points of such a group are therefore compared with the cubic through the sound points on both sides of it. If that cubic and a step between
/// two points fit all of them, it is a step. Where two arcs meet, the curvature jumps by some 0.06/mm, which makes points 0.25 mm apart
/// deviate by 0.2 µm; for points farther apart the deviation grows with the square of the distance.
pub fn oddity(points: Points, range: [usize; 2]) -> Option<Oddity> {
    let around = [
        range[0].saturating_sub(ODD_WINDOW),
        (range[1] + ODD_WINDOW).min(points.at.len()),
    ];
    let off: Vec<f64> = (around[0]..around[1])
        .map(|k| off_neighbours(points, k).unwrap_or_default())
        .collect();
    let size = |j: usize| off[j].abs();
    let mut worst: Option<Oddity> = None;
    for here in range[0] - around[0]..range[1] - around[0] {
        let own = size(here);
        let near = here.saturating_sub(3)..(here + 4).min(off.len());
        let here_spacing = spacing_around(points, around[0] + here);
        let least = ODD_MIN * (here_spacing / ODD_SPACING).powi(2).max(1.0);
        if own < least || near.clone().any(|j| size(j) > own) {
            continue;
        }
        let far = here.saturating_sub(ODD_WINDOW)..(here + ODD_WINDOW + 1).min(off.len());
        // The neighbours are excluded, because an outlier makes them deviate too.
        let mut usual: Vec<f64> = far.filter(|j| !near.contains(j)).map(size).collect();
        if own <= ODD_MEDIANS * median(&mut usual) {
            continue;
        }
        let belongs = |j: &usize| size(*j) > ODD_PART * own;
        let first = (0..=here).rev().take_while(belongs).last().unwrap_or(here);
        let last = (here..off.len()).take_while(belongs).last().unwrap_or(here);
        let found = explained(points, [around[0] + first, around[0] + last]);
        let larger = |known: &Oddity, found: &Oddity| found.size() > known.size();
        if let Some(found) = found
            && worst.is_none_or(|known| larger(&known, &found))
        {
            worst = Some(found);
        }
    }
    worst
}

/// What displaces the points of a group, first and last included.
fn explained(points: Points, [first, last]: [usize; 2]) -> Option<Oddity> {
    if last + 1 - first > ODD_POINTS_MAX {
        return None;
    }
    let from = first.saturating_sub(ODD_SOUND);
    let to = (last + ODD_SOUND + 1).min(points.at.len());
    let (to_chord, length) = chord_axes(&points.at[from..to]);
    let local: Vec<[f64; 2]> = points.at[from..to].iter().map(to_chord).collect();
    let inside = |k: usize| (first..=last).contains(&(from + k));
    let off = |k: usize| {
        let t = local[k][0];
        let powers = |at: &[f64; 2]| {
            let x = (at[0] - t) / length;
            ([1.0, x, x * x, x * x * x], at[1])
        };
        let sound = local.iter().enumerate().filter(|(j, _)| !inside(*j));
        let sound: Vec<_> = sound.map(|(_, at)| powers(at)).collect();
        Some(local[k][1] - first_coefficient(&sound)?)
    };
    let deviations: Option<Vec<f64>> = (first - from..=last - from).map(off).collect();
    let deviations = deviations?;
    let largest = deviations
        .iter()
        .fold(0.0_f64, |most, off| most.max(off.abs()));
    // A cubic and a step after each point of the group in turn.
    let steps = (first.saturating_sub(1).max(from)..=last).filter_map(|point| {
        let [height, left] = step_after(&local, point - from, length)?;
        Some((point, height, left))
    });
    let best = steps.min_by(|a, b| a.2.total_cmp(&b.2));
    if let Some((point, height, left)) = best
        && left < ODD_PART * largest
        && left < ODD_PART * height.abs()
    {
        return Some(Oddity::Step { point, height });
    }
    let is_off = |k: &usize| deviations[*k].abs() > ODD_PART * largest;
    let displaced: Vec<usize> = (0..deviations.len()).filter(is_off).collect();
    let farthest = (0..deviations.len())
        .max_by(|a, b| deviations[*a].abs().total_cmp(&deviations[*b].abs()))?;
    Some(Oddity::Outliers {
        points: [first + displaced[0], first + displaced[displaced.len() - 1]],
        count: displaced.len(),
        farthest: first + farthest,
        distance: largest,
    })
}

/// Height of a step after a point in mm and the largest distance of a point from the cubic with this step, both in mm.
fn step_after(local: &[[f64; 2]], point: usize, length: f64) -> Option<[f64; 2]> {
    let after = |k: usize| if k > point { 1.0 } else { 0.0 };
    let middle = 0.5 * length;
    // The step first, so that its height is the first coefficient.
    let rows: Vec<([f64; 5], f64)> = (local.iter().enumerate())
        .map(|(k, at)| {
            let x = (at[0] - middle) / length;
            ([after(k), 1.0, x, x * x, x * x * x], at[1])
        })
        .collect();
    let height = first_coefficient(&rows)?;
    let left = |k: usize| {
        let t = local[k][0];
        let row = |(j, at): (usize, &[f64; 2])| {
            let x = (at[0] - t) / length;
            ([1.0, x, x * x, x * x * x], at[1] - height * after(j))
        };
        let rows: Vec<_> = local.iter().enumerate().map(row).collect();
        Some((local[k][1] - height * after(k) - first_coefficient(&rows)?).abs())
    };
    let left: Option<Vec<f64>> = (0..local.len()).map(left).collect();
    Some([height, left?.into_iter().fold(0.0, f64::max)])
}

/// Mean distance in mm of the seven points around a point, fewer at the ends.
fn spacing_around(points: Points, k: usize) -> f64 {
    let (first, last) = (k.saturating_sub(3), (k + 3).min(points.along.len() - 1));
    (points.along[last] - points.along[first]) / (last - first).max(1) as f64
}

/// Height in mm of a point above the least-squares cubic of its six neighbours; `None` where these are too far away or uneven, or a corner
/// lies between them.
fn off_neighbours(points: Points, k: usize) -> Option<f64> {
    let first = k.checked_sub(3)?;
    let local = in_chord(window_at::<7>(points, first)?);
    let span = local[6][0] - local[0][0];
    let longest = (first..first + 6)
        .map(|k| points.chord(k))
        .fold(0.0, f64::max);
    let uneven = span > ODD_SPAN_MAX && longest > ODD_CHORD_MAX * span / 6.0;
    if span > COARSE_SPAN_MAX || uneven || (first + 1..first + 6).any(|k| is_corner(points.at, k)) {
        return None;
    }
    let others = [0, 1, 2, 4, 5, 6].map(|j| local[j]);
    Some(local[3][1] - fitted::<4, 6>(others, local[3][0])?)
}

/// Mean length in mm of the chords if the points of a range lie on a polygon, that is, were interpolated linearly between fewer points.
///
/// Such points lie on straight lines to the digits they are given with, and turn at the corners (or, where no point lies on a corner, at the
/// two next to it). `digits` is the step in mm of which all coordinates are multiples: it moves a point by up to `digits/√2` and changes a
/// turn by up to `√2 digits (1/a + 1/b)` between chords of lengths a and b. A kink turns by more than three times this, and has points
/// that turn by no more than this on both sides. On a smooth curve the turn cannot be both.
pub fn polygon(points: Points, range: [usize; 2], digits: f64) -> Option<f64> {
    let bound = |k: usize| {
        let [before, after] = [points.chord(k - 1), points.chord(k)];
        2.0_f64.sqrt() * digits * (1.0 / before + 1.0 / after)
    };
    let last = range[1].min(points.at.len()).saturating_sub(1);
    let (mut kinks, mut others): (Vec<[f64; 2]>, usize) = (Vec::new(), 0);
    // The points since the last straight one, and their turns.
    let mut open: Option<Vec<(usize, f64)>> = None;
    for k in range[0].max(1)..last {
        let turned = turn(points.at, k);
        if turned.abs() <= bound(k) {
            match open.replace(Vec::new()).as_deref() {
                Some([(at, turned)]) => kinks.push([points.along[*at], *turned]),
                Some([(at, one), (_, two)]) => {
                    kinks.push([points.along[*at] + 0.5 * points.chord(*at), one + two]);
                }
                Some([]) | None => {}
                Some(_) => others += 1,
            }
        } else if turned.abs() > 3.0 * bound(k) {
            if let Some(open) = &mut open {
                open.push((k, turned));
            }
        } else {
            open = None;
        }
    }
    let (sum, sizes) = kinks
        .iter()
        .fold((0.0_f64, 0.0), |(sum, sizes), [_, turned]| {
            (sum + turned, sizes + turned.abs())
        });
    let one_way = sum.abs() >= KINKS_ONE_WAY * sizes;
    if kinks.len() < KINKS_MIN.max(others) || !one_way {
        return None;
    }
    let chords = kinks.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    Some(median(&mut chords.collect::<Vec<f64>>()))
}

/// The digits that points were given with: the coarser of the steps in mm of which all y and all z are multiples, and at least 1e-9 mm.
pub fn digits(given: &[[f64; 2]]) -> f64 {
    let of = |part| step_of(given, part, DIGITS_MAX, 1e-4).unwrap_or(DIGITS_LEAST);
    of(0).max(of(1))
}

/// The largest power of ten, 0.1 or less, of which all coordinates in one direction are multiples.
fn step_of(given: &[[f64; 2]], part: usize, digits: i32, tolerance: f64) -> Option<f64> {
    let multiples = |places: &f64| {
        given.iter().all(|at| {
            let scaled = at[part] * places;
            (scaled - scaled.round()).abs() < tolerance
        })
    };
    let mut places = (1..=digits).map(|places| 10.0_f64.powi(places));
    places.find(multiples).map(f64::recip)
}

/// The step in mm of which every height is a multiple (0.1, 0.01 or 0.001), if there is one.
pub fn rounding(given: &[[f64; 2]]) -> Option<f64> {
    step_of(given, 1, 3, 1e-6)
}

/// So many points from one on, if there are as many.
fn window_at<const N: usize>(points: Points<'_>, first: usize) -> Option<&[[f64; 2]; N]> {
    points.at.get(first..)?.first_chunk()
}

/// The points in axes along and perpendicular to the chord from the first to the last of them.
fn in_chord<const N: usize>(window: &[[f64; 2]; N]) -> [[f64; 2]; N] {
    let (to_chord, _) = chord_axes(window);
    window.map(|at| to_chord(&at))
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

/// Value at `t` of the least-squares polynomial with `N` coefficients through points `[t, h]`.
fn fitted<const N: usize, const POINTS: usize>(points: [[f64; 2]; POINTS], t: f64) -> Option<f64> {
    let scale = points
        .iter()
        .map(|at| (at[0] - t).abs())
        .fold(0.0, f64::max);
    let rows = points.map(|at| {
        let mut powers = [1.0; N];
        for k in 1..N {
            powers[k] = powers[k - 1] * (at[0] - t) / scale;
        }
        (powers, at[1])
    });
    first_coefficient(&rows)
}

/// The median; 0 for an empty list.
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Least length in mm of a stray chord at an end of a profile.
const STRAY: f64 = 10.0;
/// Least length of a stray chord relative to the median chord.
const STRAY_MEDIANS: f64 = 8.0;
/// Most points beyond a stray chord.
const STRAY_POINTS_MAX: usize = 2;

/// Points at either end that lie beyond a stray chord, with the length of that chord in mm: `[count, length]` at the first and
/// at the last end.
pub fn stray_ends(points: &[[f64; 2]]) -> [Option<(usize, f64)>; 2] {
    let chords: Vec<f64> = points
        .windows(2)
        .map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]))
        .collect();
    let usual = median(&mut chords.clone());
    let farthest = |from_end: &mut dyn Iterator<Item = &f64>| {
        let near = (1..).zip(from_end.copied()).take(STRAY_POINTS_MAX);
        near.filter(|(_, chord)| *chord > STRAY.max(STRAY_MEDIANS * usual))
            .last()
    };
    [
        farthest(&mut chords.iter()),
        farthest(&mut chords.iter().rev()),
    ]
}

/// Points of a profile with their distance along it, both in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Points<'a> {
    /// `[y, z]` in mm, z up.
    pub at: &'a [[f64; 2]],
    /// Sum of the lengths of the chords up to each point.
    pub along: &'a [f64],
}

impl<'a> Points<'a> {
    /// Indices of the points in a range of the length: the first, and one past the last.
    pub fn numbers(&self, range: [f64; 2]) -> [usize; 2] {
        let first = self.along.partition_point(|s| *s < range[0]);
        let last = self.along.partition_point(|s| *s <= range[1]);
        [first, last.max(first)]
    }

    /// The points in a range of the length and one beyond on either side; at least four if there are that many.
    #[must_use]
    pub fn within(&self, range: [f64; 2]) -> Points<'a> {
        let [first, last] = self.numbers(range);
        let (first, last) = (first.saturating_sub(2), (last + 2).min(self.at.len()));
        Points {
            at: &self.at[first..last],
            along: &self.along[first..last],
        }
    }

    /// Length of the chord from a point to the next.
    pub(crate) fn chord(&self, k: usize) -> f64 {
        self.along[k + 1] - self.along[k]
    }
}

/// Bounds of the spacing of the comparison in mm. How much the readings depend on them was not measured beyond the tests and the class *damaged profile* of
/// `docs/stability.md`.
const STEP: [f64; 2] = [0.1, 0.2];
/// Places of the comparison from one point to the next, within these bounds. Chosen by judgement: a cubic between two points is seen.
const PLACES: f64 = 4.0;
/// Distance in mm by which the comparison and the measurement of noise extend beyond twice the half width of the contact.
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

/// Roughness at the contact `[low, high]`, in mm along the profile. Compares the readings there and beside it, at equally spaced points.
/// The contact modulus is in MPa.
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
    let part = points.within([first - SUPPORT * reference, last + SUPPORT * reference]);
    let spacing =
        (part.along[part.along.len() - 1] - part.along[0]) / (part.along.len() - 1) as f64;
    let step = (spacing / PLACES).clamp(STEP[0], STEP[1]);
    let step = step.max((last - first) / SAMPLES_MAX as f64);
    let count = ((last - first) / step).floor() as usize + 1;
    let places = || (0..count).map(|k| first + step * k as f64);
    let used: Vec<([f64; 2], [f64; 2])> = places()
        .map(|s| curve.at(s))
        .map(|used| (used.at, used.tangent()))
        .collect();
    let pressures = |other: &PlaneCurve| {
        let heights: Vec<f64> = (used.iter().zip(places()))
            .map(|(used, s)| above(*used, other.position(s)))
            .collect();
        flattening(&heights, step, 1.0)
    };
    let over_contact = |pressures: &[f64]| {
        let inside = places().zip(pressures);
        let inside = inside.filter(|(s, _)| (low..=high).contains(s));
        let (sum, count) = inside.fold((0.0, 0.0_f64), |(sum, count), (_, pressure)| {
            (sum + pressure * pressure, count + 1.0)
        });
        modulus * (sum / count.max(1.0)).sqrt()
    };
    let waves = pressures(&PlaneCurve::through(part.at, part.along, reference));
    let ambiguity = match smoothing > 0.0 {
        true => 0.0,
        false => over_contact(&pressures(&PlaneCurve::akima(part.at, part.along))),
    };
    let mut sizes: Vec<f64> = waves.iter().map(|pressure| pressure.abs()).collect();
    Roughness {
        waviness: over_contact(&waves),
        everywhere: modulus * (median(&mut sizes) / MEDIAN_OF_NORMAL),
        ambiguity,
    }
}

/// Distance from a point of a curve, given with its unit tangent, to another curve along its normal, positive if the first is above.
fn above((at, tangent): ([f64; 2], [f64; 2]), other: [f64; 2]) -> f64 {
    tangent[0] * (at[1] - other[1]) - tangent[1] * (at[0] - other[0])
}

/// Length in mm over which heights are tapered to 0 at both ends.
const TAPER: f64 = 2.0;

thread_local! {
    /// Plans of the transforms, which take longer to make than to use. They follow from their lengths alone; there are a dozen at most.
    static PLANNER: RefCell<RealFftPlanner<f32>> = RefCell::new(RealFftPlanner::new());
}

/// Pressure in MPa that flattens `heights` in mm, `step` mm apart, with the contact modulus in MPa; one value per height.
pub fn flattening(heights: &[f64], step: f64, modulus: f64) -> Vec<f64> {
    let count = heights.len();
    // As many zeros keep the periodic transform from coupling the two ends.
    let padded = (2 * count).max(2).next_power_of_two();
    let mut values = vec![0.0; padded];
    for (k, height) in heights.iter().enumerate() {
        let from_end = step * k.min(count - 1 - k) as f64;
        let share = match from_end < TAPER {
            true => 0.5 * (1.0 - (PI * from_end / TAPER).cos()),
            false => 1.0,
        };
        values[k] = (share * height) as f32;
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
        *entry *= (0.5 * modulus * wavenumber / padded as f64) as f32;
    }
    if let Some(last) = spectrum.last_mut() {
        last.im = 0.0;
    }
    spectrum[0].im = 0.0;
    let done = backward.process(&mut spectrum, &mut values);
    debug_assert!(done.is_ok());
    values.truncate(count);
    values.into_iter().map(f64::from).collect()
}

/// Pressure in MPa that white noise of deviation `noise` mm at a spacing of `spacing` mm leaves after a smoothing that halves
/// waves of `cut` mm: `2.34 E* s √(h/L³)`, from `2 (π E*)² s² h / L³ · ∫ x²/(1+x⁴)² dx` with the integral `π√2/16`.
pub fn noise_pressure(modulus: f64, noise: f64, spacing: f64, cut: f64) -> f64 {
    2.34 * modulus * noise * (spacing / cut.powi(3)).sqrt()
}

/// Range of smoothing lengths that are advised, in mm. Shorter ones do not remove the noise of neighbouring points, longer ones distort
/// gauge corners and flange roots (radii of 13 to 20 mm; 5 mm changes the largest pressure by 2 %, 10 mm by 27 % in one of ten cases).
pub const SMOOTHING_ADVISED: [f64; 2] = [2.0, 8.0];
/// Noise, as a share of the largest pressure, that remains after the advised smoothing. Between 0.05 and 0.1 neither pressures nor forces
/// change by more than their scatter; population: 18 places on three pairs with noise of 1 to 20 µm.
const NOISE_LEFT: f64 = 0.07;
/// Noise without smoothing, as a share of the largest pressure, below which no smoothing is advised.
const NOISE_HARMLESS: f64 = 0.01;
/// Smoothing length, in chords, that turns a polygon into a smooth curve; a shorter one changes no coarse points.
pub(crate) const CHORDS: f64 = 2.0;
/// Noise in steps of rounding: the deviation of an even distribution of width 1 is 1/√12. Up to twice this it is due to the rounding.
const ROUNDED: f64 = 0.289;
/// Waviness over that which the noise explains, up to which noise is its cause: estimates from few points scatter by a factor of 2.
const EXPLAINED: f64 = 3.0;
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
pub fn noise_of(reading: &PointsRead, range: [usize; 2]) -> Option<f64> {
    let least = ROUNDED * reading.rounding.unwrap_or(0.0);
    Some(noise(reading.points, range)?.max(least))
}

/// Length in mm of the chords if the points of a range were interpolated linearly between fewer points.
pub fn polygon_of(reading: &PointsRead, range: [usize; 2]) -> Option<f64> {
    polygon(reading.points, range, reading.digits)
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
    let whole = [0, points.at.len()];
    let near = half.max(REFERENCE_MIN);
    let near = points.numbers([low - near, high + near]);
    let noise = noise_of(reading, around).or_else(|| noise_of(reading, whole));
    let roughness = roughness(reading, contact, modulus);
    let rounding = reading.rounding;
    let rounding = rounding.filter(|step| noise.is_some_and(|noise| noise <= 2.0 * ROUNDED * step));
    let white = rounding.is_some() || is_white(points, around);
    let cut = reading.smoothing.max(2.0 * spacing);
    let explained = noise_pressure(modulus, noise.unwrap_or(0.0), spacing, cut);
    UnderContact {
        chord: [points.along[widest], points.along[widest + 1]],
        over_width: points.chord(widest) / (high - low),
        spacing,
        noise,
        roughness,
        polygon: polygon_of(reading, around),
        oddity: oddity(points, near),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn chords(at: &[[f64; 2]]) -> Vec<f64> {
        let mut along = vec![0.0];
        for pair in at.windows(2) {
            let chord = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            along.push(along[along.len() - 1] + chord);
        }
        along
    }

    /// What `of` finds in all points.
    fn with<T>(at: &[[f64; 2]], of: impl Fn(Points, [usize; 2]) -> T) -> T {
        let along = chords(at);
        let points = Points { at, along: &along };
        of(points, [0, at.len()])
    }

    /// Points of a circle of 80 mm every 0.3 mm.
    fn arc(count: u32) -> Vec<[f64; 2]> {
        let angle = |k: u32| 0.3 / 80.0 * (f64::from(k) - 0.5 * f64::from(count));
        (0..count)
            .map(|k| [80.0 * angle(k).sin(), 80.0 * angle(k).cos()])
            .collect()
    }

    /// Normally distributed numbers of deviation 1: sums of twelve even ones of a congruential generator (Knuth's MMIX).
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
        let Some(Oddity::Outliers {
            points: [90, 90],
            count: 1,
            farthest: 90,
            distance,
        }) = with(&points, oddity)
        else {
            panic!("{:?}", with(&points, oddity))
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
                let found = with(&points, oddity);
                let Some(Oddity::Outliers {
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
        let Some(Oddity::Step { point, height }) = with(&points, oddity) else {
            panic!("{:?}", with(&points, oddity))
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
    fn noise_is_white_and_waves_are_not() {
        let mut points = arc(400);
        for (at, noise) in points.iter_mut().zip(normal(400)) {
            at[1] += 0.002 * noise;
        }
        assert!(with(&points, is_white));
        for length in [4.0, 7.0, 12.0] {
            let mut points = arc(400);
            for (k, at) in points.iter_mut().enumerate() {
                at[1] += 0.002 * (TAU * k as f64 / length).sin();
            }
            assert!(!with(&points, is_white), "{length}");
        }
    }

    #[test]
    fn the_digits_are_those_of_the_coarser_coordinate() {
        assert_eq!(digits(&[[0.25, 1.5], [-1.0, 3.125]]), 0.01);
        assert_eq!(digits(&[[0.1, 1.0], [-1.0, 3.0]]), 0.1);
        let third = 1.0 / 3.0;
        assert_eq!(digits(&[[0.1, third], [0.2, 1.0]]), 0.1);
        assert_eq!(digits(&[[third, third], [third, 1.0]]), DIGITS_LEAST);
    }

    #[test]
    fn the_coarsest_decimal_of_all_heights_is_the_rounding() {
        assert_eq!(rounding(&[[0.0, 1.2], [1.0, 3.4]]), Some(0.1));
        assert_eq!(rounding(&[[0.0, 1.2], [1.0, 3.45]]), Some(0.01));
        assert_eq!(rounding(&[[0.0, 1.2345], [1.0, 3.45]]), None);
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
        roughness(&reading, CONTACT, MODULUS)
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
