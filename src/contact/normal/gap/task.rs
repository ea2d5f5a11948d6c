//! The gap problem: the surfaces and their load; and estimates of a contact from the samples of its gap, before it is solved.

use std::f64::consts::PI;

use crate::normal::gap::surface::{GapSurface, Window};
use crate::normal::hertz::NormalLoad;
use crate::numerics::ITERATIONS_MAX;

/// Two bodies pressed together, with the gap between them.
#[derive(Debug, Clone, PartialEq)]
pub struct GapTask {
    /// The gap of the undeformed bodies.
    pub gap: GapSurface,
    /// Force, or approach counted from gap = 0.
    pub loading: NormalLoad,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
}

/// Part of the approach up to which valleys between asperities are pressed flat.
const DEPTH: f64 = 0.05;
/// Largest number of asperities that a grid can distinguish.
const ASPERITIES_MAX: usize = 48;

impl GapTask {
    /// The search box of the contact.
    pub(crate) fn reach(&self) -> SearchBox {
        reach(&self.gap, self.loading, self.contact_modulus)
    }

    /// Estimated number of asperities that touch, at least 1: those with valleys between them that are not pressed flat.
    pub fn asperities(&self) -> usize {
        let SearchBox {
            window,
            level,
            least,
        } = self.reach();
        let samples = self.gap.samples();
        let within = |k: usize| -> Vec<f64> {
            let [low, high] = window[k];
            let inside = samples[k].iter().filter(|at| (low..=high).contains(*at));
            inside.copied().collect()
        };
        let middle = |k: usize| [0.5 * (window[k][0] + window[k][1])];
        // Samples on the middle lines of both axes.
        let (x, y) = (within(0), within(1));
        let lines = [self.gap.on(&x, &middle(1)), self.gap.on(&middle(0), &y)];
        let minima = lines.map(|line| valleys(&line, level, DEPTH * (level - least)));
        minima[0].max(minima[1]).clamp(1, ASPERITIES_MAX)
    }
}

/// Number of minima of a line that lie below a level and are separated by ridges higher than a depth.
fn valleys(line: &[f64], level: f64, depth: f64) -> usize {
    let (mut bottom, mut ridge) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut rising = false;
    let mut count = 0;
    for value in line {
        if rising {
            ridge = ridge.max(*value);
            if ridge - value > depth {
                (rising, bottom) = (false, *value);
            }
        } else {
            bottom = bottom.min(*value);
            if value - bottom > depth {
                count += usize::from(bottom < level);
                (rising, ridge) = (true, *value);
            }
        }
    }
    count + usize::from(!rising && bottom < level)
}

/// Number of points of a box along each axis. With 24 a gap of a few bumps has a force that is 8 % off.
const POINTS: usize = 48;
/// Largest number of samples along an axis that are all evaluated; of more samples, only every second or third is.
const SAMPLES_MAX: usize = 400;

/// Part of a box along both axes that the region must fill. Chosen by judgement.
const FILLED: f64 = 0.5;
/// Safety factor on the estimated approach. On smooth gaps it was never too small; otherwise the solution shows it and the box grows.
pub(super) const MARGIN: f64 = 1.3;

/// A box of the contact plane with the level it was made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchBox {
    pub(crate) window: Window,
    /// A lower bound in mm of the gap outside the window, within the data.
    pub(crate) level: f64,
    /// The least gap found, in mm.
    pub(crate) least: f64,
}

/// The gap at points of a box.
struct GapSamples {
    axes: [Vec<f64>; 2],
    values: Vec<f64>,
    least: f64,
}

/// The box in which contact is possible under a load.
///
/// Contact lies where the gap is smaller than the approach, for any pressure. The approach of a force is estimated as if the region that overlaps by half of it
/// were a circle of the same area pressed by a sphere, which is exact for a paraboloid: `N = 4/3 E* √(A/π) δ`, where A is the area in which the gap is less than
/// `δ/2` above its minimum.
pub(crate) fn reach(gap: &GapSurface, loading: NormalLoad, contact_modulus: f64) -> SearchBox {
    let limits = gap.window();
    let mut window = first_box(gap);
    let mut level = f64::INFINITY;
    let mut least = f64::INFINITY;
    // Each iteration shrinks a box that is too large by at least half.
    for _ in 0..ITERATIONS_MAX {
        let samples = GapSamples::new(gap, window);
        least = samples.least;
        level = match loading {
            NormalLoad::Approach(approach) => approach,
            NormalLoad::Force(force) => {
                samples.least + MARGIN * samples.depth(force / contact_modulus)
            }
        };
        let mut next = samples.below(level, limits);
        if let Some(rolling) = gap.rolling_radius()
            && level > least
        {
            let half = 1.02 * (2.0 * rolling * (level - least)).sqrt();
            next[0] = [-half, half];
        }
        let filled = (0..2).all(|k| length(next[k]) >= FILLED * length(window[k]));
        window = next;
        if filled {
            break;
        }
    }
    SearchBox {
        window,
        level,
        least,
    }
}

/// The box in which the gap is less than `level`.
pub(crate) fn reach_of_level(gap: &GapSurface, level: f64) -> SearchBox {
    reach(gap, NormalLoad::Approach(level), f64::NAN)
}

fn length(range: [f64; 2]) -> f64 {
    range[1] - range[0]
}

/// The whole window. Where a formula holds, the length at which the gap exceeds all samples.
fn first_box(gap: &GapSurface) -> Window {
    let mut window = gap.window();
    if let Some(rolling) = gap.rolling_radius() {
        let [low, high] = gap.extremes();
        let half = (2.0 * rolling * (high - low)).sqrt();
        window[0] = [-half, half];
    }
    window
}

impl GapSamples {
    fn new(gap: &GapSurface, window: Window) -> GapSamples {
        let samples = gap.samples();
        let axes = [0, 1].map(|k| points(window[k], samples[k]));
        let values = gap.on(&axes[0], &axes[1]);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        GapSamples {
            axes,
            values,
            least,
        }
    }

    /// Estimated approach beyond the least gap, for the force divided by the contact modulus.
    fn depth(&self, force: f64) -> f64 {
        let shares = [0, 1].map(|k| shares(&self.axes[k]));
        let width = self.axes[0].len();
        let share = |k: usize| shares[0][k % width] * shares[1][k / width];
        let heights = self.values.iter().enumerate();
        let mut cells: Vec<(f64, f64)> = heights
            .map(|(k, value)| (value - self.least, share(k)))
            .collect();
        cells.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut area = 0.0;
        let mut carried = |(height, share): &(f64, f64)| {
            area += share;
            8.0 / 3.0 * (area / PI).sqrt() * height
        };
        match cells.iter().find(|cell| carried(cell) >= force) {
            Some((height, _)) => 2.0 * height,
            None => 0.75 * force / (area / PI).sqrt(),
        }
    }

    /// The box around all points with a gap below a level, wider by one point on every side; around the deepest point if there is none.
    fn below(&self, level: f64, limits: Window) -> Window {
        let width = self.axes[0].len();
        let level = level.max(self.least);
        let mut found = [[usize::MAX, 0]; 2];
        for k in (0..self.values.len()).filter(|k| self.values[*k] <= level) {
            for (range, i) in found.iter_mut().zip([k % width, k / width]) {
                *range = [range[0].min(i), range[1].max(i)];
            }
        }
        [0, 1].map(|k| {
            let axis = &self.axes[k];
            let [first, last] = found[k];
            let before = axis[first.saturating_sub(1)];
            let after = axis[(last + 1).min(axis.len() - 1)];
            [before.max(limits[k][0]), after.min(limits[k][1])]
        })
    }
}

/// Points of a range including both ends: the samples in it, or equally spaced points if there are too few samples.
fn points(range: [f64; 2], samples: &[f64]) -> Vec<f64> {
    let [low, high] = range;
    let inside: Vec<f64> = samples
        .iter()
        .copied()
        .filter(|x| *x > low && *x < high)
        .collect();
    if inside.len() < POINTS {
        let at = |k: usize| low + (high - low) * (k as f64 / (POINTS - 1) as f64);
        return (0..POINTS)
            .map(|k| if k + 1 == POINTS { high } else { at(k) })
            .collect();
    }
    let stride = inside.len().div_ceil(SAMPLES_MAX);
    let mut points = vec![low];
    points.extend(inside.into_iter().step_by(stride));
    points.push(high);
    points
}

/// The length of the axis that each point represents.
fn shares(axis: &[f64]) -> Vec<f64> {
    let n = axis.len();
    (0..n)
        .map(|k| 0.5 * (axis[(k + 1).min(n - 1)] - axis[k.saturating_sub(1)]))
        .collect()
}

#[cfg(test)]
mod asperities_tests {
    use super::*;

    #[test]
    fn valleys_count_where_ridges_part_them() {
        assert_eq!(valleys(&[], 1.0, 0.1), 0);
        assert_eq!(valleys(&[1.0, 0.0, 1.0], 0.5, 0.1), 1);
        assert_eq!(valleys(&[0.0, 0.05, 0.0], 0.5, 0.1), 1);
        assert_eq!(valleys(&[0.0, 0.2, 0.0, 0.2, 0.0], 0.5, 0.1), 3);
        // The middle one is too high to touch.
        assert_eq!(valleys(&[0.0, 1.0, 0.7, 1.0, 0.0, 1.0], 0.5, 0.1), 2);
    }
}

#[cfg(test)]
mod search_box_tests {
    use super::*;
    use crate::normal::hertz::Ellipse;

    fn parabola(radius: f64, half: f64) -> (Vec<f64>, Vec<f64>) {
        let y: Vec<f64> = (-20..=20).map(|k| half * f64::from(k) / 20.0).collect();
        let gap = y.iter().map(|y| 0.5 * y * y / radius).collect();
        (y, gap)
    }

    #[test]
    fn the_box_holds_hertzs_contact_and_is_not_much_larger() {
        let modulus = 115_000.0;
        for (rolling, lateral) in [(300.0, 300.0), (460.0, 40.0), (100.0, 3000.0)] {
            for force in [1.0, 1e3, 1e5] {
                let loading = NormalLoad::Force(force);
                let hertz = Ellipse::of_radii(rolling, lateral, loading, modulus);
                let (y, values) = parabola(lateral, 40.0 * hertz.b);
                let reach = reach(&GapSurface::profile(rolling, &y, &values), loading, modulus);
                assert!(
                    reach.level > hertz.approach,
                    "{} {}",
                    reach.level,
                    hertz.approach
                );
                for (range, half) in reach.window.into_iter().zip([hertz.a, hertz.b]) {
                    assert!(range[0] < -half && range[1] > half, "{range:?} {half}");
                    assert!(length(range) < 2.0 * 2.6 * half, "{range:?} {half}");
                }
            }
        }
    }

    #[test]
    fn a_level_below_everything_ends_at_the_deepest_point() {
        let (y, values) = parabola(300.0, 10.0);
        let reach = reach_of_level(&GapSurface::profile(460.0, &y, &values), -1.0);
        assert!(reach.least.abs() < 1e-9 && reach.level == -1.0);
    }

    #[test]
    fn data_end_the_box() {
        let (y, values) = parabola(300.0, 2.0);
        let reach = reach(
            &GapSurface::profile(460.0, &y, &values),
            NormalLoad::Force(1e6),
            1e5,
        );
        assert_eq!(reach.window[1], [-2.0, 2.0]);
        assert!(length(reach.window[0]) > 10.0);
    }
}
