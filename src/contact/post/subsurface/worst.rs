//! The worst point of a patch, and the smallest enclosing ball of stress deviators.
//!
//! **Worst point**: the point with the largest von Mises stress. At each of several depths, columns are scanned, and a search in
//! `(x/a, y/b, ln depth)` begins at the worst of them: friction has its worst points near the surface, pressure below it, and the patch of worn
//! profiles has several of both. The worst of the points found is the result.
//!
//! **Smallest enclosing ball**: required by the fatigue criterion of Dang Van and the theorem of Melan. A deviator is a point with five coordinates,
//! whose distances are those of the tensors. The centre may be free only in the first coordinates and is 0 in the others. The dual problem maximises
//! the mean square distance of the weighted points from their mean. It is solved by steps toward the farthest and away from the nearest point
//! (Yildirim 2008, Two algorithms for the minimum enclosing ball problem). Primal and dual bound the radius from both sides.

use std::convert::Infallible;

use crate::mesh::Chord;
use crate::normal::footprint::Footprint;
use crate::post::subsurface::load_parts::LoadResolution;
use crate::post::subsurface::states::von_mises;
use crate::post::subsurface::surface_load::{LoadWorkspace, SurfaceLoad};

// With these constants, the stress found is up to 0.40 % more, and never less, than the largest one of a scan of 7497 points, in 15 contacts with a/b
// from 0.2 to 6 from no slip to full slip (`cargo test --test physics -- the_worst_point --nocapture`). Their individual influence was not measured.

/// Numbers of columns along x and y, and the outermost of them relative to half chord and half width.
pub(crate) const COLUMNS: [(u32, f64); 2] = [(13, 1.02), (7, 0.9)];
/// Depths relative to the half-width of the patch, from the least on.
pub(crate) const DEPTHS: [f64; 8] = [0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.5, 0.8];
/// First steps in `x/a`, `y/b` and `ln depth`.
pub(crate) const STEPS: [f64; 3] = [0.12, 0.15, 0.2];
/// Number of times that the steps of a search, or the intervals next to decisive states of a passage, are halved.
pub(crate) const HALVINGS: u32 = 4;

/// A patch below which stresses are searched.
#[derive(Debug, Clone, Copy)]
pub struct BelowPatch<'a> {
    /// The loads on the body.
    pub load: &'a SurfaceLoad<'a>,
    /// The loaded region.
    pub footprint: &'a Footprint,
    /// Number of the patch.
    pub patch: usize,
    /// Least depth in mm.
    pub least: f64,
}

impl BelowPatch<'_> {
    /// Half of the width of the patch in mm.
    fn half_width(&self) -> f64 {
        let [.., y_min, y_max] = self.footprint.patches()[self.patch].extent;
        0.5 * (y_max - y_min)
    }

    /// Converts `[y/b, ln(depth/small)]` to `[y, depth]` in mm, where `small` is half of the smaller extent.
    pub(crate) fn place(&self, [across, depth]: [f64; 2]) -> [f64; 2] {
        let [x_min, x_max, y_min, y_max] = self.footprint.patches()[self.patch].extent;
        let small = 0.5 * (x_max - x_min).min(y_max - y_min);
        let y = 0.5 * (y_min + y_max) + self.half_width() * across;
        [y, (small * depth.exp()).max(self.least)]
    }
}

/// `[x, y, depth]` in mm of the worst point below a patch.
pub fn worst_place(of: BelowPatch, workspace: &mut LoadWorkspace) -> Option<[f64; 3]> {
    let place = |[s, t, depth]: [f64; 3]| {
        let [y, depth] = of.place([t, depth]);
        let chords = of.footprint.chords(of.patch, &[(y, of.half_width())]);
        let length = |chord: &Chord| chord.right - chord.left;
        let longest = chords
            .iter()
            .max_by(|a, b| length(a).total_cmp(&length(b)))?;
        let x = 0.5 * (longest.left + longest.right) + 0.5 * s * length(longest);
        Some([x, y, depth])
    };
    let mut badness = |at: [f64; 3], resolution| match place(at) {
        Some(at) => von_mises(of.load.stress(at, resolution, workspace)),
        None => 0.0,
    };
    let none = (f64::NEG_INFINITY, [0.0; 3]);
    let starts = DEPTHS.map(|depth| {
        let mut start = none;
        for x in spread(COLUMNS[0]) {
            for y in spread(COLUMNS[1]) {
                let at = [x, y, depth.ln()];
                start = higher(start, (badness(at, LoadResolution::COARSE), at));
            }
        }
        start
    });
    let mut worst = none;
    for (_, start) in starts {
        let Ok((at, (found, ()))) = climb(start, STEPS, |at| {
            Ok::<_, Infallible>((badness(at, LoadResolution::FINE), ()))
        });
        worst = higher(worst, (found, at));
    }
    place(worst.1)
}

/// Evenly spaced positions from minus the outermost to the outermost.
pub(crate) fn spread((count, outermost): (u32, f64)) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| outermost * (f64::from(2 * k) / f64::from(count - 1) - 1.0))
}

/// The one of two places with the larger value.
fn higher(a: (f64, [f64; 3]), b: (f64, [f64; 3])) -> (f64, [f64; 3]) {
    if b.0 > a.0 { b } else { a }
}

/// Searches for the maximum of a function by steps along the axes. Returns the argument, the value and the additional result of the function there.
/// Steps are halved if none leads higher. The search ends with the last of the [`HALVINGS`].
///
/// # Errors
/// Returns the errors of `height`.
pub(crate) fn climb<const N: usize, T: Copy, E>(
    start: [f64; N],
    mut steps: [f64; N],
    mut height: impl FnMut([f64; N]) -> Result<(f64, T), E>,
) -> Result<([f64; N], (f64, T)), E> {
    let (mut at, mut best) = (start, height(start)?);
    let mut halvings = 0;
    while halvings < HALVINGS {
        let before = best.0;
        for axis in 0..N {
            for sign in [1.0, -1.0] {
                let mut tried = at;
                tried[axis] += sign * steps[axis];
                let found = height(tried)?;
                if found.0 > best.0 {
                    (at, best) = (tried, found);
                    break;
                }
            }
        }
        if best.0 <= before {
            steps = steps.map(|step| 0.5 * step);
            halvings += 1;
        }
    }
    Ok((at, best))
}

/// A deviator in coordinates whose sum of squares is that of the components of the tensor.
pub type Deviator = [f64; 5];

/// Tolerance of the relative duality gap in the square of the radius. Chosen by judgement.
pub(crate) const GAP: f64 = 1e-6;
/// Most steps of the search for a ball.
const STEPS_MAX: usize = 2000;

/// A ball that encloses points.
#[derive(Debug, Clone, PartialEq)]
pub struct EnclosingBall {
    /// Its centre.
    pub centre: Deviator,
    /// The largest distance of a point from the centre.
    pub radius: f64,
    /// Relative duality gap in the square of the radius. The radius is too large by at most half of it. It is above [`GAP`] if the steps were used up.
    pub gap: f64,
    /// Weights of the points. Only points on the sphere have positive weights.
    pub weights: Vec<f64>,
}

/// Finds the smallest enclosing ball whose centre is free in the first `free` coordinates. Without points its radius is 0.
pub fn enclosing_ball(points: &[Deviator], free: usize) -> EnclosingBall {
    ball_within(points, free, STEPS_MAX)
}

/// Finds the ball with at most `steps_max` steps.
fn ball_within(points: &[Deviator], free: usize, steps_max: usize) -> EnclosingBall {
    let mut ball = EnclosingBall {
        centre: [0.0; 5],
        radius: 0.0,
        gap: 0.0,
        weights: vec![0.0; points.len()],
    };
    if points.is_empty() {
        return ball;
    }
    ball.weights[0] = 1.0;
    ball.centre[..free].copy_from_slice(&points[0][..free]);
    for step in 0..=steps_max {
        let apart = |k: usize| squared(&points[k], &ball.centre, 5);
        let distances: Vec<f64> = (0..points.len()).map(apart).collect();
        let held = |k: &usize| ball.weights[*k] > 0.0;
        let by = |a: &usize, b: &usize| distances[*a].total_cmp(&distances[*b]);
        let far = (0..points.len()).max_by(by).unwrap_or(0);
        let near = (0..points.len()).filter(held).min_by(by).unwrap_or(far);
        let mean: f64 = (distances.iter().zip(&ball.weights))
            .map(|(distance, weight)| distance * weight)
            .sum();
        ball.radius = distances[far].sqrt();
        ball.gap = if distances[far] > 0.0 {
            (distances[far] - mean) / distances[far]
        } else {
            0.0
        };
        if ball.gap <= GAP || step == steps_max {
            break;
        }
        let forward = distances[far] - mean >= mean - distances[near];
        let k = if forward { far } else { near };
        let gain = (distances[k] - mean).abs();
        let best = 0.5 * gain / squared(&points[k], &ball.centre, free);
        let share = if forward {
            best.min(1.0)
        } else {
            -best.min(ball.weights[k] / (1.0 - ball.weights[k]))
        };
        let removed = !forward && -share < best;
        for weight in &mut ball.weights {
            *weight *= 1.0 - share;
        }
        ball.weights[k] = if removed {
            0.0
        } else {
            ball.weights[k] + share
        };
        for (centre, point) in ball.centre[..free].iter_mut().zip(points[k]) {
            *centre += share * (point - *centre);
        }
    }
    ball
}

/// Squared distance in the first coordinates.
fn squared(point: &Deviator, centre: &Deviator, first: usize) -> f64 {
    (0..first).map(|c| (point[c] - centre[c]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_finds_the_top_of_a_hill() {
        let top = [0.3, -0.2, -0.9];
        let height = |at: [f64; 3]| {
            let off: f64 = (0..3).map(|k| (at[k] - top[k]).powi(2)).sum();
            5.0 - off
        };
        let Ok((at, (found, ()))) = climb([0.2, 0.0, -0.7], STEPS, |at| {
            Ok::<_, Infallible>((height(at), ()))
        });
        assert!(found > 5.0 - 1e-3, "{found} at {at:?}");
    }
}

#[cfg(test)]
mod enclosing_ball_tests {
    use super::*;

    #[test]
    fn a_simplex_has_its_circumscribed_ball_and_a_fixed_coordinate_stays() {
        let corners: Vec<Deviator> = (0..5)
            .map(|k| std::array::from_fn(|c| if c == k { 2.0 } else { 0.0 }))
            .collect();
        let ball = enclosing_ball(&corners, 5);
        // The centre is 2/5 in each coordinate: (8/5)² + 4 (2/5)² = 16/5.
        assert!((ball.radius - 3.2_f64.sqrt()).abs() < 2e-6, "{ball:?}");
        // The centre is free in the first coordinate only.
        let points = [
            [0.0; 5],
            [4.0, 0.0, 0.0, 0.0, 0.0],
            [2.0, 3.0, 0.0, 0.0, 0.0],
        ];
        let ball = enclosing_ball(&points, 1);
        assert!((ball.radius - 3.0).abs() < 1e-5 && (ball.centre[0] - 2.0).abs() < 1e-2);
        assert_eq!(ball.centre[1..], [0.0; 4]);
    }

    #[test]
    fn a_ball_whose_steps_are_used_up_says_by_how_much_it_may_be_too_large() {
        let points: Vec<Deviator> = (0..40)
            .map(|k| std::array::from_fn(|c| (1.3 * f64::from(k) + c as f64).sin()))
            .collect();
        let exact = enclosing_ball(&points, 5);
        assert!(exact.gap <= GAP, "{exact:?}");
        for steps in [0, 1, 3, 10] {
            let ball = ball_within(&points, 5, steps);
            let too_large = ball.radius / exact.radius - 1.0;
            assert!(ball.gap > GAP, "{steps}: {ball:?}");
            assert!(too_large >= -GAP, "{steps}: {too_large}");
            // The dual bounds the square of the radius from below.
            let least = ball.radius * (1.0 - ball.gap).max(0.0).sqrt();
            assert!(least <= exact.radius * (1.0 + GAP), "{steps}: {ball:?}");
        }
    }

    #[test]
    fn no_centre_is_better_than_the_one_found() {
        let mut seed = 7_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for free in 1..=5 {
            let points: Vec<Deviator> = (0..60).map(|_| std::array::from_fn(|_| draw())).collect();
            let ball = enclosing_ball(&points, free);
            let reach = |centre: &Deviator| {
                let all = points.iter().map(|p| squared(p, centre, 5));
                all.fold(0.0, f64::max).sqrt()
            };
            assert!((reach(&ball.centre) - ball.radius).abs() < 1e-12);
            for _ in 0..200 {
                let mut centre = ball.centre;
                for value in &mut centre[..free] {
                    *value += 0.02 * draw();
                }
                assert!(reach(&centre) > ball.radius * (1.0 - 1e-6), "{free}");
            }
        }
    }
}
