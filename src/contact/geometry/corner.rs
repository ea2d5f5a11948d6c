//! Sharp corners of a chain of points, at which no smooth curve passes through them.

/// Turn of the chords at a corner, in rad (30°). A chain that is fine enough for its shape turns less.
const TURN: f64 = 0.52;
/// A corner turns by more than this multiple of both neighbouring points: next to a displaced point it is 2, and on a coarse arc all turn
/// alike.
const CONCENTRATED: f64 = 2.5;
/// A neighbour beyond a chord longer than this multiple of the chord on the other side does not count: a chamfer has corners at both ends.
const FAR: f64 = 4.0;

/// The angle in rad between the chords before and after a point, positive to the left; 0 at the ends.
pub(crate) fn turn(points: &[[f64; 2]], k: usize) -> f64 {
    if k == 0 || k + 1 >= points.len() {
        return 0.0;
    }
    let [before, after] = [chord(points, k - 1), chord(points, k)];
    let cross = before[0] * after[1] - before[1] * after[0];
    cross.atan2(before[0] * after[0] + before[1] * after[1])
}

/// Whether the points have a sharp corner at this one.
pub(crate) fn is_corner(points: &[[f64; 2]], k: usize) -> bool {
    let own = turn(points, k).abs();
    if own <= TURN {
        return false;
    }
    let length = |k: usize| {
        let [y, z] = chord(points, k);
        y.hypot(z)
    };
    let (before, after) = (length(k - 1), length(k));
    let smooth = |neighbour: usize, chord: f64, other: f64| {
        chord > FAR * other || own > CONCENTRATED * turn(points, neighbour).abs()
    };
    smooth(k - 1, before, after) && smooth(k + 1, after, before)
}

/// The chord from a point to the next.
fn chord(points: &[[f64; 2]], k: usize) -> [f64; 2] {
    [0, 1].map(|part| points[k + 1][part] - points[k][part])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(points: &[[f64; 2]]) -> Vec<usize> {
        (0..points.len())
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
