//! What the shape of a profile shows: whether it is a rail or a wheel, where the flange tip is, and which end points are stray.

use crate::contact::geometry::profile_quality::noise::median;
use crate::contact::geometry::profile_quality::samples::Points;

/// Distance in mm below the highest point at which the head of a rail is measured, and above the lowest point that of a flange tip.
const PIECE: f64 = 2.0;
/// Least width of the head in mm. Population: 12 rails and rollers with heads of 37 to 56 mm, 15 to 64 mm from an end.
const HEAD_MIN: f64 = 25.0;
/// Least distance of its top from both ends, in mm; the same population.
const HEAD_FROM_END: f64 = 10.0;
/// Least and largest width of the tip of a flange in mm. Population: 8 complete wheels with tips of 12 to 18 mm, 5 to 60 mm from an end.
const TIP: [f64; 2] = [5.0, 25.0];
/// Least distance of the tip from both ends, in mm; the same population.
const TIP_FROM_END: f64 = 3.0;
/// Least length in mm of a stray chord at an end of a profile.
const STRAY: f64 = 10.0;
/// Least length of a stray chord relative to the median chord.
const STRAY_MEDIANS: f64 = 8.0;
/// Most points beyond a stray chord.
const STRAY_POINTS_MAX: usize = 2;

/// The body that a shape resembles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LikelyBody {
    /// A rail's head: wide on top and far from both ends.
    Rail,
    /// A wheel: its flange has a narrow tip.
    Wheel,
}

/// The body that the points resemble, for either sense of z; `None` if the shape is inconclusive.
#[must_use]
pub fn looks_like(points: &[[f64; 2]]) -> Option<LikelyBody> {
    let mirrored: Vec<[f64; 2]> = points.iter().map(|[y, z]| [*y, -z]).collect();
    let either = |test: fn(&[[f64; 2]]) -> bool| test(points) || test(&mirrored);
    match (either(has_head), either(has_tip)) {
        (true, false) => Some(LikelyBody::Rail),
        (false, true) => Some(LikelyBody::Wheel),
        _ => None,
    }
}

/// Whether the part within 2 mm of the highest point is wide and away from the ends.
fn has_head(points: &[[f64; 2]]) -> bool {
    let Some((top, piece)) = piece_at_top(points) else {
        return false;
    };
    let [first, last] = ends(points);
    piece[1] - piece[0] >= HEAD_MIN
        && points[top][0] - first >= HEAD_FROM_END
        && last - points[top][0] >= HEAD_FROM_END
}

/// Whether the part within 2 mm of the lowest point is narrow and away from the ends.
fn has_tip(points: &[[f64; 2]]) -> bool {
    let mirrored: Vec<[f64; 2]> = points.iter().map(|[y, z]| [*y, -z]).collect();
    let Some((tip, piece)) = piece_at_top(&mirrored) else {
        return false;
    };
    let [first, last] = ends(points);
    (TIP[0]..=TIP[1]).contains(&(piece[1] - piece[0]))
        && points[tip][0] - first >= TIP_FROM_END
        && last - points[tip][0] >= TIP_FROM_END
}

/// The range of y of the tip of a wheel's flange (within 2 mm of its lowest point, z up).
#[must_use]
pub fn flange_tip(points: Points) -> Option<[f64; 2]> {
    let mirrored: Vec<[f64; 2]> = points.at.iter().map(|[y, z]| [*y, -z]).collect();
    has_tip(points.at).then(|| piece_at_top(&mirrored).map(|(_, piece)| piece))?
}

fn ends(points: &[[f64; 2]]) -> [f64; 2] {
    let y = || points.iter().map(|at| at[0]);
    [
        y().fold(f64::INFINITY, f64::min),
        y().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// The index of the highest point, and the range of y of its neighbours that are at most 2 mm lower.
fn piece_at_top(points: &[[f64; 2]]) -> Option<(usize, [f64; 2])> {
    let top = (0..points.len()).max_by(|a, b| points[*a][1].total_cmp(&points[*b][1]))?;
    let near = |k: &usize| points[*k][1] > points[top][1] - PIECE;
    let after = (top..points.len()).take_while(near).last()?;
    let before = (0..=top).rev().take_while(near).last()?;
    let (a, b) = (points[before][0], points[after][0]);
    Some((top, [a.min(b), a.max(b)]))
}

/// Points at either end that lie beyond a stray chord, with the length of that chord in mm: `[count, length]` at the first and
/// at the last end.
#[must_use]
pub fn stray_ends(points: &[[f64; 2]]) -> [Option<(usize, f64)>; 2] {
    let chords: Vec<f64> = points
        .windows(2)
        .map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]))
        .collect();
    let usual = median(&mut chords.clone());
    let stray = |k: usize| {
        let chord = *chords.get(k)?;
        (chord > STRAY && chord > STRAY_MEDIANS * usual).then_some(chord)
    };
    let count = chords.len();
    let first = (0..STRAY_POINTS_MAX)
        .rev()
        .find_map(|k| Some((k + 1, stray(k)?)));
    let last = (0..STRAY_POINTS_MAX)
        .rev()
        .find_map(|k| Some((k + 1, stray(count.checked_sub(k + 1)?)?)));
    [first, last]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A head of 70 mm, z up: flat on top with a fall of `y²/600`, sides that fall steeply.
    fn head() -> Vec<[f64; 2]> {
        (-350..=350)
            .map(|k| 0.1 * f64::from(k))
            .map(|y: f64| [y, -y * y / 600.0 - 3.0 * (y.abs() - 30.0).max(0.0)])
            .collect()
    }

    /// A wheel, z up: a flange of 28 mm with a round tip of 15 mm beside a tread of 100 mm.
    fn wheel() -> Vec<[f64; 2]> {
        (-700..=600)
            .map(|k| 0.1 * f64::from(k))
            .map(|y: f64| [y, -28.0 * (-((y + 45.0) / 15.0).powi(2)).exp()])
            .collect()
    }

    fn upside_down(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        points.iter().map(|[y, z]| [*y, -z]).collect()
    }

    #[test]
    fn a_rail_looks_like_a_rail_and_a_wheel_like_a_wheel_whatever_the_sense_of_z() {
        for (points, looks) in [(head(), LikelyBody::Rail), (wheel(), LikelyBody::Wheel)] {
            assert_eq!(looks_like(&points), Some(looks));
            assert_eq!(looks_like(&upside_down(&points)), Some(looks));
        }
        let line: Vec<[f64; 2]> = (0..50)
            .map(|k| [f64::from(k), 0.2 * f64::from(k)])
            .collect();
        assert_eq!(looks_like(&line), None);
    }

    #[test]
    fn the_tip_of_a_flange_is_the_piece_within_two_millimetres_of_its_lowest_point() {
        let points = wheel();
        let along: Vec<f64> = points.iter().map(|at| at[0]).collect();
        let tip = flange_tip(Points {
            at: &points,
            along: &along,
            known: None,
        });
        let [from, to] = tip.expect("a flange");
        // 28 exp(−(d/15)²) = 26 at d = 15 √ln(28/26).
        let half = 15.0 * (28.0_f64 / 26.0).ln().sqrt();
        assert!((from + 45.0 + half).abs() < 0.11, "{from}");
        assert!((to + 45.0 - half).abs() < 0.11, "{to}");
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
