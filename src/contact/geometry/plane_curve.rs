//! Plane curves whose coordinates are cubics between common knots, prepared for many evaluations, and chains of points: their lengths,
//! corners and crossings.

use crate::numerics::interpolation::{Spline, akima_slopes};
use crate::numerics::roots::bounds;

/// A curve `[y, z]` in mm over a parameter in mm, twice continuously differentiable except at sharp corners, straight beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneCurve {
    /// First and last parameter.
    range: [f64; 2],
    intervals: Vec<CurveInterval>,
    /// The range of the parameter is divided into equal cells. For each cell this is the interval in which it begins, so that the interval of
    /// a parameter is found without a search.
    cells: Vec<u32>,
    cells_per_mm: f64,
}

/// The curve between two knots.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurveInterval {
    /// Both knots in mm.
    ends: [f64; 2],
    /// Coefficients `[y, z]` of the powers of the distance from the first knot.
    cubic: [[f64; 2]; 4],
}

/// The curve at one parameter: position in mm and derivatives with respect to the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Position `[y, z]`.
    pub at: [f64; 2],
    /// First derivative, of length about 1.
    pub slope: [f64; 2],
    /// Second derivative.
    pub bend: [f64; 2],
}

impl CurvePoint {
    /// Unit tangent, from the track centre to the field side along the curve.
    pub fn tangent(&self) -> [f64; 2] {
        let length = self.slope[0].hypot(self.slope[1]);
        self.slope.map(|part| part / length)
    }

    /// Curvature in 1/mm, positive where the curve bends upward.
    pub fn curvature(&self) -> f64 {
        let [y, z] = self.slope;
        (y * self.bend[1] - z * self.bend[0]) / y.hypot(z).powi(3)
    }
}

impl PlaneCurve {
    /// Fits a curve to the points `at` in mm with the parameters `along`: splines that end at sharp corners. Waves shorter than about
    /// `cut_wavelength` mm are smoothed away; with 0 the curve passes through all points.
    pub fn through(at: &[[f64; 2]], along: &[f64], cut_wavelength: f64) -> PlaneCurve {
        let last = at.len() - 1;
        let corners = (1..last).filter(|k| is_corner(at, *k));
        let ends: Vec<usize> = std::iter::once(0).chain(corners).chain([last]).collect();
        let piece = |pair: &[usize]| {
            let (from, to) = (pair[0], pair[1]);
            let values = [0, 1].map(|part| at[from..=to].iter().map(|at| at[part]).collect());
            let pinned = [from > 0, to < last];
            Spline::pair(&along[from..=to], values, cut_wavelength, pinned)
        };
        let pieces: Vec<[Spline; 2]> = ends.windows(2).map(piece).collect();
        PlaneCurve::new(&pieces)
    }

    /// Akima's curve through the points `at` in mm with the parameters `along`. Only its first derivative is continuous.
    pub fn akima(at: &[[f64; 2]], along: &[f64]) -> PlaneCurve {
        let [y, z] = [0, 1].map(|part| {
            let values: Vec<f64> = at.iter().map(|at| at[part]).collect();
            akima_slopes(along, &values)
        });
        let slopes = |k: usize| [y[k], z[k]];
        let between = |k: usize| {
            let ends = [along[k], along[k + 1]];
            let step = ends[1] - ends[0];
            let (leaving, arriving) = (slopes(k), slopes(k + 1));
            let rise = [0, 1].map(|part| (at[k + 1][part] - at[k][part]) / step);
            let second = |part: usize| 3.0 * rise[part] - 2.0 * leaving[part] - arriving[part];
            let third = |part: usize| leaving[part] + arriving[part] - 2.0 * rise[part];
            let powers = [
                [0, 1].map(|part| second(part) / step),
                [0, 1].map(|part| third(part) / (step * step)),
            ];
            CurveInterval {
                ends,
                cubic: [at[k], leaving, powers[0], powers[1]],
            }
        };
        PlaneCurve::of((0..along.len() - 1).map(between).collect())
    }

    /// Joins pieces, each of two splines with the same knots.
    fn new(pieces: &[[Spline; 2]]) -> PlaneCurve {
        let cubics = |[y, z]: &[Spline; 2]| {
            let knots = y.knots().windows(2).enumerate();
            let between = |(i, ends): (usize, &[f64])| {
                let (y, z) = (y.cubic(i), z.cubic(i));
                CurveInterval {
                    ends: [ends[0], ends[1]],
                    cubic: [0, 1, 2, 3].map(|power| [y[power], z[power]]),
                }
            };
            knots.map(between).collect::<Vec<CurveInterval>>()
        };
        PlaneCurve::of(pieces.iter().flat_map(cubics).collect())
    }

    fn of(intervals: Vec<CurveInterval>) -> PlaneCurve {
        // With two cells per interval and evenly spaced knots, hardly any parameter is more than one interval beyond that of its cell.
        let count = 2 * intervals.len();
        let range = [intervals[0].ends[0], intervals[intervals.len() - 1].ends[1]];
        let length = range[1] - range[0];
        let mut after = 0;
        let begins = |cell: usize| {
            let place = range[0] + length * cell as f64 / count as f64;
            while after < intervals.len() && intervals[after].ends[0] <= place {
                after += 1;
            }
            (after.max(1) - 1) as u32
        };
        PlaneCurve {
            cells: (0..count).map(begins).collect(),
            cells_per_mm: count as f64 / length,
            intervals,
            range,
        }
    }

    /// First and last parameter.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The curve at a parameter. Beyond its ends the curve continues along the tangent.
    #[inline]
    pub fn at(&self, s: f64) -> CurvePoint {
        let [first, last] = self.range();
        let inside = s.clamp(first, last);
        let CurveInterval { ends, cubic } = self.interval(inside);
        let d = inside - ends[0];
        let [c0, c1, c2, c3] = cubic;
        let mut point = CurvePoint {
            at: [0, 1].map(|k| c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k]))),
            slope: [0, 1].map(|k| c1[k] + d * (2.0 * c2[k] + 3.0 * d * c3[k])),
            bend: [0, 1].map(|k| 2.0 * c2[k] + 6.0 * d * c3[k]),
        };
        if inside != s {
            point.at = [0, 1].map(|k| point.at[k] + point.slope[k] * (s - inside));
            point.bend = [0.0; 2];
        }
        point
    }

    /// Position at a parameter within the range.
    #[inline]
    pub(crate) fn position(&self, s: f64) -> [f64; 2] {
        let CurveInterval { ends, cubic } = self.interval(s);
        let d = s - ends[0];
        let [c0, c1, c2, c3] = cubic;
        [0, 1].map(|k| c0[k] + d * (c1[k] + d * (c2[k] + d * c3[k])))
    }

    /// The interval that contains a parameter within the range.
    #[inline]
    fn interval(&self, s: f64) -> &CurveInterval {
        let cell = ((s - self.range[0]) * self.cells_per_mm) as usize;
        let mut i = self.cells[cell.min(self.cells.len() - 1)] as usize;
        // Rounding may have chosen the next cell.
        while i > 0 && self.intervals[i].ends[0] > s {
            i -= 1;
        }
        while i + 1 < self.intervals.len() && self.intervals[i].ends[1] <= s {
            i += 1;
        }
        &self.intervals[i]
    }

    /// Returns the curve rotated about the origin by an angle in rad from y to z, then shifted by `[y, z]`, then mirrored in y if `sign` is −1.
    #[must_use]
    pub fn placed(&self, angle: f64, by: [f64; 2], sign: f64) -> PlaneCurve {
        let (sin, cos) = angle.sin_cos();
        let turned = |[y, z]: [f64; 2]| [cos * y - sin * z, sin * y + cos * z];
        let placed = |[c0, c1, c2, c3]: [[f64; 2]; 4]| {
            let [y, z] = turned(c0);
            let powers = [[y + by[0], z + by[1]], turned(c1), turned(c2), turned(c3)];
            powers.map(|[y, z]| [sign * y, z])
        };
        let interval = |interval: &CurveInterval| CurveInterval {
            cubic: placed(interval.cubic),
            ..*interval
        };
        PlaneCurve {
            intervals: self.intervals.iter().map(interval).collect(),
            ..self.clone()
        }
    }

    /// Parameters at most `step` apart over the whole curve, ends included.
    pub fn parameters(&self, step: f64) -> Vec<f64> {
        let [first, last] = self.range();
        let count = ((last - first) / step).ceil().max(1.0);
        (0..=count as usize)
            .map(|k| first + (last - first) * k as f64 / count)
            .collect()
    }
}

/// Tangent of the least turn at a corner (30°). Points that are dense enough for their shape turn less.
const CORNER_TANGENT: f64 = 0.573;
/// Least ratio of the turn at a corner to the turns at the two neighbouring points. At a displaced point the ratio is 2, on a coarse arc it
/// is 1.
const CORNER_CONCENTRATION: f64 = 2.5;
/// A neighbour is ignored if the chord to it is longer than this multiple of the other chord, because a chamfer has corners at both ends.
const CORNER_CHORD_RATIO: f64 = 4.0;

/// Length in mm of the chords that must turn as well, because noise turns shorter ones. With white noise of 20 µm these turn by 6° (standard deviation).
const CORNER_REACH: f64 = 0.5;

/// Distance between two points.
pub(crate) fn distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// Lengths of the chords of a chain of points.
pub(crate) fn chords(points: &[[f64; 2]]) -> impl Iterator<Item = f64> {
    points.windows(2).map(|pair| distance(pair[0], pair[1]))
}

/// Length of a chain of points from its first point to each point.
pub(crate) fn arc_lengths(points: &[[f64; 2]]) -> Vec<f64> {
    let mut sum = 0.0;
    let sums = chords(points).map(|chord| {
        sum += chord;
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Sine and cosine of the angle between the chords of three points, times both lengths. The angle is positive to the left.
fn turning([from, at, to]: [[f64; 2]; 3]) -> [f64; 2] {
    let [before, after] = [[from, at], [at, to]].map(|[a, b]| [b[0] - a[0], b[1] - a[1]]);
    [
        before[0] * after[1] - before[1] * after[0],
        before[0] * after[0] + before[1] * after[1],
    ]
}

/// The angle in rad between the chords before and after a point, positive to the left; 0 at the ends.
pub(crate) fn turn(points: &[[f64; 2]], k: usize) -> f64 {
    if k == 0 || k + 1 >= points.len() {
        return 0.0;
    }
    let [sine, cosine] = turning([points[k - 1], points[k], points[k + 1]]);
    sine.atan2(cosine)
}

/// Returns whether there is a sharp corner at a point, which must not be the first or the last one.
pub(crate) fn is_corner(points: &[[f64; 2]], k: usize) -> bool {
    let at = points[k];
    let is_sharp = |before: [f64; 2], after: [f64; 2]| {
        let [sine, cosine] = turning([before, at, after]);
        sine.abs() > CORNER_TANGENT * cosine
    };
    let is_far = |other: &&[f64; 2]| distance(at, **other) >= CORNER_REACH;
    let (left, right) = (&points[..k], &points[k + 1..]);
    let far_left = left.iter().rev().find(is_far).unwrap_or(&points[0]);
    let far_right = right.iter().find(is_far).or(right.last());
    if !is_sharp(points[k - 1], points[k + 1])
        || !far_right.is_some_and(|right| is_sharp(*far_left, *right))
    {
        return false;
    }
    let own = turn(points, k).abs();
    let before = distance(points[k - 1], points[k]);
    let after = distance(points[k], points[k + 1]);
    let smooth = |neighbour: usize, chord: f64, other: f64| {
        chord > CORNER_CHORD_RATIO * other
            || own > CORNER_CONCENTRATION * turn(points, neighbour).abs()
    };
    smooth(k - 1, before, after) && smooth(k + 1, after, before)
}

/// Finds two chords that cross and are not neighbours, and returns their first points.
///
/// The chords are sorted along the axis on which they overlap less, and only those that overlap there are compared.
pub fn crossing(points: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    let count = points.len().saturating_sub(1);
    let range = |axis: usize, k: usize| bounds([points[k][axis], points[k + 1][axis]]);
    let overlap = |axis: usize| {
        let [low, high] = bounds(points.iter().map(|at| at[axis]));
        let lengths = (0..count).map(|k| range(axis, k)[1] - range(axis, k)[0]);
        lengths.sum::<f64>() / (high - low).max(f64::MIN_POSITIVE)
    };
    let axis = usize::from(overlap(1) < overlap(0));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| range(axis, *a)[0].total_cmp(&range(axis, *b)[0]));
    order.iter().enumerate().find_map(|(place, one)| {
        let [_, end] = range(axis, *one);
        let mut near = order[place + 1..]
            .iter()
            .take_while(|other| range(axis, **other)[0] <= end);
        let other = near.find(|other| {
            one.abs_diff(**other) > 1 && cross(points, *one.min(*other), *one.max(*other))
        })?;
        Some([points[*one.min(other)], points[*one.max(other)]])
    })
}

/// Returns whether the chords that begin at two points cross.
fn cross(points: &[[f64; 2]], i: usize, j: usize) -> bool {
    let [a, b, c, d] = [i, i + 1, j, j + 1].map(|k| points[k]);
    let left = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) > 0.0
    };
    left(a, b, c) != left(a, b, d) && left(c, d, a) != left(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::roots::interval;

    /// Knots whose distances vary by a factor of 300.
    fn uneven() -> [Spline; 2] {
        let knots: Vec<f64> = (0..40)
            .map(|k| f64::from(k) + if k % 7 == 3 { 0.997 } else { 0.0 })
            .collect();
        let values = [f64::sin as fn(f64) -> f64, f64::cos]
            .map(|f| knots.iter().map(|s| f(0.3 * s)).collect());
        Spline::pair(&knots, values, 0.0, [false; 2])
    }

    #[test]
    fn the_curve_is_that_of_its_splines_everywhere_and_straight_beyond() {
        let [y, z] = uneven();
        let curve = PlaneCurve::new(&[[y.clone(), z.clone()]]);
        for k in -50..=460 {
            let s = 0.1 * f64::from(k);
            let point = curve.at(s);
            for (part, spline) in [&y, &z].into_iter().enumerate() {
                let knots = spline.knots();
                let inside = s.clamp(knots[0], knots[knots.len() - 1]);
                let i = interval(knots, inside);
                let (d, [c0, c1, c2, c3]) = (inside - knots[i], spline.cubic(i));
                let slope = c1 + d * (2.0 * c2 + 3.0 * d * c3);
                let value = c0 + d * (c1 + d * (c2 + d * c3)) + slope * (s - inside);
                let bend = match s == inside {
                    true => 2.0 * c2 + 6.0 * d * c3,
                    false => 0.0,
                };
                assert!((point.at[part] - value).abs() < 1e-13, "{s}");
                assert!((point.slope[part] - slope).abs() < 1e-12, "{s}");
                assert!((point.bend[part] - bend).abs() < 1e-12, "{s}");
            }
        }
    }

    /// A tread of 500 mm radius that ends at a face, as a wheel's does.
    #[test]
    fn a_curve_does_not_overshoot_beside_a_corner() {
        let tread = |k: i32| [0.25 * f64::from(k), -(0.25 * f64::from(k)).powi(2) / 1000.0];
        let mut at: Vec<[f64; 2]> = (-40..=40).map(tread).collect();
        let edge = at[80];
        at.extend((1..=5).map(|k| [edge[0], edge[1] + 4.0 * f64::from(k)]));
        let along = arc_lengths(&at);
        for smoothing in [0.0, 3.0] {
            let curve = PlaneCurve::through(&at, &along, smoothing);
            let corner = curve.at(along[80]).at;
            assert!((corner[0] - edge[0]).hypot(corner[1] - edge[1]) < 1e-9);
            // Near its free end a smoothed curve is straighter.
            for s in curve.parameters(0.01).into_iter().filter(|s| *s > 10.0) {
                let [y, z] = curve.at(s).at;
                let off = if s < along[80] {
                    z + y * y / 1000.0
                } else {
                    y - edge[0]
                };
                assert!(off.abs() < 1e-3, "{smoothing}: {off} at {s}");
            }
        }
    }

    #[test]
    fn a_placed_curve_is_turned_moved_and_mirrored() {
        let [y, z] = uneven();
        let curve = PlaneCurve::new(&[[y.clone(), z.clone()]]);
        let placed = curve.placed(0.4, [3.0, -2.0], -1.0);
        let (sin, cos) = 0.4_f64.sin_cos();
        for s in [-1.0, 0.0, 3.3, 17.99, 39.0] {
            let [y, z] = curve.at(s).at;
            let expected = [-(cos * y - sin * z + 3.0), sin * y + cos * z - 2.0];
            let found = placed.at(s).at;
            assert!((found[0] - expected[0]).abs() < 1e-12);
            assert!((found[1] - expected[1]).abs() < 1e-12);
        }
    }

    /// The next number of a linear congruential generator, from 0 to 1.
    pub(super) fn random(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn corners(points: &[[f64; 2]]) -> Vec<usize> {
        (1..points.len() - 1)
            .filter(|k| is_corner(points, *k))
            .collect()
    }

    /// Points of a circle of 13 mm, each turned by `step` rad from the one before.
    fn arc(step: f64) -> Vec<[f64; 2]> {
        let count = (3.0 / step) as u32;
        let angle = |k: u32| step * f64::from(k);
        (0..=count)
            .map(|k| [13.0 * angle(k).sin(), 13.0 * angle(k).cos()])
            .collect()
    }

    #[test]
    fn a_corner_is_one_whatever_the_spacing_beside_it() {
        for far in [0.25, 1.0, 8.0] {
            let points = [
                [-0.5, 0.0],
                [-0.25, 0.0],
                [0.0, 0.0],
                [0.0, -far],
                [0.0, -2.0 * far],
            ];
            assert_eq!(corners(&points), [2], "{far}");
        }
        let chamfer = [
            [-0.5, 0.0],
            [-0.25, 0.0],
            [0.0, 0.0],
            [5.0, -5.0],
            [5.0, -5.25],
            [5.0, -5.5],
        ];
        assert_eq!(corners(&chamfer), [2, 3]);
    }

    #[test]
    fn noise_of_dense_points_is_no_corner() {
        let mut state = 1;
        let mut noise = || random(&mut state) - 0.5;
        for spacing in [0.05, 0.1, 0.25] {
            let line = (0..2000).map(|k| [spacing * f64::from(k), 0.07 * noise()]);
            let mut points: Vec<[f64; 2]> = line.collect();
            assert_eq!(corners(&points), [0; 0], "{spacing}");
            let last = points[1999];
            points.extend((1..200).map(|k| [last[0], last[1] + spacing * f64::from(k)]));
            assert!(corners(&points).iter().all(|k| k.abs_diff(1999) <= 1));
        }
    }

    #[test]
    fn arcs_and_displaced_points_have_no_corner() {
        for step in [0.02, 0.2, 0.4, 0.6] {
            assert_eq!(corners(&arc(step)), [0; 0], "{step}");
        }
        for off in [0.05, 0.2, 0.5] {
            let mut points: Vec<[f64; 2]> = (0..9).map(|k| [0.25 * f64::from(k), 0.0]).collect();
            points[4][1] += off;
            assert_eq!(corners(&points), [0; 0], "{off}");
        }
    }
}

#[cfg(test)]
mod crossing_tests {
    use super::tests::random;
    use super::*;

    /// Compares every pair of chords.
    fn by_pairs(points: &[[f64; 2]]) -> bool {
        let chords = points.len() - 1;
        (0..chords).any(|i| (i + 2..chords).any(|j| cross(points, i, j)))
    }

    /// A pseudo-random walk whose turns grow with `unrest`.
    fn walk(seed: u64, count: usize, unrest: f64) -> Vec<[f64; 2]> {
        let mut state = seed;
        let mut angle = 0.0_f64;
        let mut at = [0.0; 2];
        let step = |_| {
            angle += unrest * (random(&mut state) - 0.5);
            at = [at[0] + angle.cos(), at[1] + angle.sin()];
            at
        };
        (0..count).map(step).collect()
    }

    #[test]
    fn chains_cross_themselves_exactly_if_a_pair_of_chords_does() {
        let mut crossed = 0;
        for seed in 0..300 {
            let unrest = 0.06 * (seed % 100) as f64;
            let points = walk(seed, 3 + (seed as usize * 7) % 90, unrest);
            let found = crossing(&points);
            assert_eq!(found.is_some(), by_pairs(&points), "{seed}: {found:?}");
            crossed += usize::from(found.is_some());
        }
        assert!((30..270).contains(&crossed), "{crossed} of 300 cross");
    }

    #[test]
    fn a_long_chain_crosses_itself_only_if_a_chord_crosses_its_turns() {
        let spiral = |k: usize| {
            let turn = 0.01 * k as f64;
            [turn * turn.cos(), turn * turn.sin()]
        };
        let points: Vec<[f64; 2]> = (0..20_000).map(spiral).collect();
        assert_eq!(crossing(&points), None);
        // One more chord crosses all turns.
        let mut crossed = points;
        crossed.push([0.0, 0.1]);
        assert!(crossing(&crossed).is_some());
    }
}
