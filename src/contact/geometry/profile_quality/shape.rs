//! End points that lie far from all others.

use crate::contact::geometry::profile_quality::noise::median;

/// Least length in mm of a stray chord at an end of a profile.
const STRAY: f64 = 10.0;
/// Least length of a stray chord relative to the median chord.
const STRAY_MEDIANS: f64 = 8.0;
/// Most points beyond a stray chord.
const STRAY_POINTS_MAX: usize = 2;

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
