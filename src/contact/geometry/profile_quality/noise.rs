//! Detects measurement artefacts in the points of a profile: noise, outliers, steps, polygons, rounding.

use crate::contact::geometry::profile_quality::samples::Points;
use crate::contact::numerics::least_squares::first_coefficient;

/// Chords in one window of the noise estimate.
const NOISE_CHORDS: usize = 4;
/// Largest length of a window in mm: over longer ones the shape itself differs from a cubic.
const NOISE_SPAN_MAX: f64 = 3.0;
/// Fewest windows for a median.
const WINDOWS_MIN: usize = 12;
/// Fewest windows of coarse points for a quartile.
const COARSE_WINDOWS_MIN: usize = 30;
/// Largest length of a window of coarse points in mm.
const COARSE_SPAN_MAX: f64 = 12.0;
/// Lower quartile of the absolute value of a normal variable of deviation 1.
const QUARTILE_OF_NORMAL: f64 = 0.3186;
/// Noise in mm that the quartile finds in the shape alone, for points 1 mm apart; it grows with the fourth power of their distance.
///
/// Population: sound rails and wheels of the class *damaged profile* with true points 0.8 to 4 mm apart: 0.002 to 0.1 µm at 1 mm, each of them
/// below this; noise of 1 µm at 1.7 mm, 3 µm at 2.5 mm is above it.
const COARSE_SHAPE: f64 = 6e-5;
/// Distance of the points in mm up to which the shape of sound profiles contributes less than 0.2 µm, or 1 % of a usual pressure.
const COARSE_TELLS: f64 = 1.8;
/// Median of the absolute value of a normal variable of deviation 1.
pub const MEDIAN_OF_NORMAL: f64 = 0.6745;
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
/// Two neighbours that deviate to opposite sides are a step if the smaller deviation is at least this share of the larger one.
const STEP_PAIR: f64 = 0.7;
/// Least share of the total turning that lies at the corners, single points or pairs, of a polygon.
const TURNING: f64 = 0.9;
/// Corner points are at most this fraction of all points.
const POLYGON_SHARE_MAX: f64 = 0.5;
/// Fewest points for which a polygon can be recognised.
const POLYGON_POINTS_MIN: usize = 24;
/// Fewest corners of a polygon.
const POLYGON_CORNERS_MIN: usize = 4;
/// Largest average number of successive points that form one corner.
const POLYGON_PAIR_MAX: f64 = 2.3;

/// A single point off the curve through its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// Index of the point.
    pub point: usize,
    /// Distance from the cubic of its neighbours in mm.
    pub distance: f64,
}

/// A jump of the profile between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Index of the point before the jump.
    pub point: usize,
    /// Height in mm, positive upward.
    pub height: f64,
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
#[must_use]
pub fn noise(points: Points, range: [usize; 2]) -> Option<f64> {
    let (mut fine, mut coarse) = (Vec::new(), Vec::new());
    let mut length = 0.0;
    for k in range[0]..range[1].saturating_sub(NOISE_CHORDS) {
        let found = || window_at(points, k).and_then(fourth_difference);
        let Some((span, difference)) = points.known(k, |known| &known.difference, found) else {
            continue;
        };
        if span <= NOISE_SPAN_MAX {
            fine.push(difference);
        } else if span <= COARSE_SPAN_MAX {
            coarse.push(difference);
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

/// Length of the chord over five points in mm, and the size of their normalised fourth divided difference in mm.
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
    let difference = (sum / length).abs();
    (span > 0.0 && difference.is_finite()).then_some((span, difference))
}

/// The worst outlier and the largest step of a range: points that deviate from the least-squares cubic of their six neighbours by more
/// than 12 local medians, by at least 1.2 µm (more where points are coarse), and by more than the adjacent points.
///
/// A step of height h makes the points on both sides deviate by h/2 in opposite directions; an outlier makes its neighbours deviate by
/// 0.43 of its own displacement. Where two arcs meet, the curvature jumps by some 0.06/mm, which makes points 0.25 mm apart deviate by
/// 0.2 µm; for points farther apart the deviation grows with the square of the distance.
#[must_use]
pub fn oddities(points: Points, range: [usize; 2]) -> (Option<Outlier>, Option<Step>) {
    let around = [
        range[0].saturating_sub(ODD_WINDOW),
        (range[1] + ODD_WINDOW).min(points.at.len()),
    ];
    let off: Vec<f64> = (around[0]..around[1])
        .map(|k| points.known(k, |known| &known.off, || off_neighbours(points, k)))
        .map(Option::unwrap_or_default)
        .collect();
    let size = |j: usize| off[j].abs();
    let (mut outlier, mut step): (Option<Outlier>, Option<Step>) = (None, None);
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
        let other = [
            here.checked_sub(1),
            Some(here + 1).filter(|j| *j < off.len()),
        ];
        let pair = other
            .into_iter()
            .flatten()
            .find(|j| -off[*j] * off[here].signum() > STEP_PAIR * own);
        match pair {
            Some(pair) if step.is_none_or(|found| found.height.abs() < 2.0 * own) => {
                let (low, high) = (here.min(pair), here.max(pair));
                step = Some(Step {
                    point: around[0] + low,
                    height: off[high] - off[low],
                });
            }
            None if outlier.is_none_or(|found| found.distance < own) => {
                outlier = Some(Outlier {
                    point: around[0] + here,
                    distance: own,
                });
            }
            _ => {}
        }
    }
    (outlier, step)
}

/// Mean distance in mm of the seven points around a point, fewer at the ends.
fn spacing_around(points: Points, k: usize) -> f64 {
    let (first, last) = (k.saturating_sub(3), (k + 3).min(points.along.len() - 1));
    (points.along[last] - points.along[first]) / (last - first).max(1) as f64
}

/// Height in mm of a point above the least-squares cubic of its six neighbours.
fn off_neighbours(points: Points, k: usize) -> Option<f64> {
    let local = in_chord(window_at::<7>(points, k.checked_sub(3)?)?);
    if local[6][0] - local[0][0] > ODD_SPAN_MAX {
        return None;
    }
    let others = [0, 1, 2, 4, 5, 6].map(|j| local[j]);
    Some(local[3][1] - fitted::<4, 6>(others, local[3][0])?)
}

/// Length in mm of the chords if the points of a range lie on a polygon, that is, were interpolated linearly between fewer points. Such
/// points change direction only at the corners (or, if no point lies on a corner, at the two beside it).
#[must_use]
pub fn polygon(points: Points, range: [usize; 2]) -> Option<f64> {
    let window = &points.at[range[0]..range[1]];
    if window.len() < POLYGON_POINTS_MIN {
        return None;
    }
    let turn = |at: &[[f64; 2]]| {
        let [a, b] = [[0, 1], [1, 2]].map(|[i, j]| {
            let [y, z] = [0, 1].map(|part| at[j][part] - at[i][part]);
            z.atan2(y)
        });
        (b - a).abs()
    };
    let turns: Vec<f64> = (window.windows(3).enumerate())
        .map(|(k, at)| points.known(range[0] + k, |known| &known.turn, || turn(at)))
        .collect();
    let total: f64 = turns.iter().sum();
    let mut sorted = turns.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let mut carried = 0.0;
    let corners = sorted
        .iter()
        .take_while(|turn| {
            let before = carried;
            carried += **turn;
            before < TURNING * total
        })
        .count();
    if total <= 0.0 || corners as f64 > POLYGON_SHARE_MAX * turns.len() as f64 {
        return None;
    }
    let least = sorted[corners - 1];
    let runs = turns.chunk_by(|a, b| (*a >= least) == (*b >= least));
    let groups = runs.filter(|run| run[0] >= least).count();
    let alone = corners as f64 <= POLYGON_PAIR_MAX * groups as f64;
    let length = points.along[range[1] - 1] - points.along[range[0]];
    (alone && groups >= POLYGON_CORNERS_MIN).then(|| length / groups as f64)
}

/// The step in mm of which every height is a multiple (0.1, 0.01 or 0.001), if there is one.
#[must_use]
pub fn rounding(given: &[[f64; 2]]) -> Option<f64> {
    let multiples = |places: f64| {
        given.iter().all(|at| {
            let scaled = at[1] * places;
            (scaled - scaled.round()).abs() < 1e-6
        })
    };
    [10.0, 100.0, 1000.0]
        .into_iter()
        .find(|places| multiples(*places))
        .map(|places| 1.0 / places)
}

/// So many points from one on, if there are as many.
fn window_at<const N: usize>(points: Points<'_>, first: usize) -> Option<&[[f64; 2]; N]> {
    points.at.get(first..)?.first_chunk()
}

/// The points in axes along and perpendicular to the chord from the first to the last of them.
fn in_chord<const N: usize>(window: &[[f64; 2]; N]) -> [[f64; 2]; N] {
    let (from, to) = (window[0], window[N - 1]);
    let chord = [to[0] - from[0], to[1] - from[1]];
    let length = chord[0].hypot(chord[1]).max(f64::MIN_POSITIVE);
    let axis = chord.map(|part| part / length);
    window.map(|at| {
        let [y, z] = [at[0] - from[0], at[1] - from[1]];
        [axis[0] * y + axis[1] * z, axis[0] * z - axis[1] * y]
    })
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
#[must_use]
pub fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::geometry::profile_quality::samples::KnownPoints;

    fn chords(at: &[[f64; 2]]) -> Vec<f64> {
        let mut along = vec![0.0];
        for pair in at.windows(2) {
            let chord = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            along.push(along[along.len() - 1] + chord);
        }
        along
    }

    /// What `of` finds, the same whether what points tell is kept or not.
    fn with<T: PartialEq + std::fmt::Debug>(
        at: &[[f64; 2]],
        of: impl Fn(Points, [usize; 2]) -> T,
    ) -> T {
        let along = chords(at);
        let points = Points {
            at,
            along: &along,
            known: None,
        };
        let found = of(points, [0, at.len()]);
        let known = KnownPoints::new(at.len());
        let kept = Points {
            known: Some(&known),
            ..points
        };
        // In a part first, so that some of it is known then.
        let part = [at.len() / 4, at.len() / 2];
        assert_eq!(of(kept, part), of(points, part));
        assert_eq!(of(kept, [0, at.len()]), found);
        found
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
        let (outlier, step) = with(&points, oddities);
        let outlier = outlier.expect("an outlier");
        assert_eq!(outlier.point, 90);
        assert!((outlier.distance / 0.02 - 1.0).abs() < 0.01, "{outlier:?}");
        assert_eq!(step, None);
        assert!(with(&points, noise).expect("enough points") < 1e-6);
    }

    #[test]
    fn a_jump_between_two_points_is_a_step_of_its_height() {
        let mut points = arc(200);
        points.iter_mut().skip(101).for_each(|at| at[1] -= 0.03);
        let (outlier, step) = with(&points, oddities);
        assert_eq!(outlier, None);
        let step = step.expect("a step");
        assert_eq!(step.point, 100);
        assert!((step.height / -0.03 - 1.0).abs() < 0.2, "{step:?}");
    }

    #[test]
    fn points_on_chords_are_a_polygon_of_that_chord_and_points_on_an_arc_are_none() {
        let corners: Vec<[f64; 2]> = arc(400).into_iter().step_by(8).collect();
        let mut points = Vec::new();
        for pair in corners.windows(2) {
            points.extend((0..10).map(|k| {
                let t = 0.1 * f64::from(k);
                [0, 1].map(|part| pair[0][part] + t * (pair[1][part] - pair[0][part]))
            }));
        }
        // Corners that carry nine tenths of the turning are counted; here all turn alike.
        let chord = with(&points, polygon).expect("a polygon");
        assert!((chord * TURNING / 2.4 - 1.0).abs() < 0.05, "{chord}");
        assert_eq!(with(&arc(400), polygon), None);
    }

    #[test]
    fn the_coarsest_decimal_of_all_heights_is_the_rounding() {
        assert_eq!(rounding(&[[0.0, 1.2], [1.0, 3.4]]), Some(0.1));
        assert_eq!(rounding(&[[0.0, 1.2], [1.0, 3.45]]), Some(0.01));
        assert_eq!(rounding(&[[0.0, 1.2345], [1.0, 3.45]]), None);
    }
}
