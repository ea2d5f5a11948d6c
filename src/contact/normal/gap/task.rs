//! What is asked of a gap: the surfaces, and how hard they are pressed together.
//!
//! Preview of a contact from the samples of its gap, cached because check and solution use it several times.
//!
//! What will the contact of a gap be like? A look at the samples, before anything is solved.
//!
//! The box in which a contact can be: it holds every point at which the bodies could touch, and is found before anything is solved.

use crate::lazy_field::LazyField;
use crate::normal::gap::surface::{GapSurface, Window};
use crate::normal::hertz::NormalLoad;

/// Two bodies with a gap between them, pressed together.
#[derive(Debug, Clone, PartialEq)]
pub struct GapTask {
    /// The gap of the undeformed bodies.
    pub gap: GapSurface,
    /// Force, or approach counted from gap = 0.
    pub loading: NormalLoad,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
    /// First looks at the contact, kept once they were taken; starts empty.
    pub seen: PreviewCache,
}

/// Estimates of a contact before it is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapPreview {
    /// Half-length along rolling and half-width of everything that touches, in mm.
    pub half: [f64; 2],
    /// Approach beyond the least gap, in mm.
    pub depth: f64,
    /// Asperities of the bodies that are likely to touch, at least 1.
    pub asperities: usize,
}

/// The cached parts of a preview.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PreviewCache {
    /// The box in which contact can be.
    pub(super) reach: LazyField<SearchBox>,
    /// Size and roughness of the contact.
    pub(super) preview: LazyField<GapPreview>,
}

/// Valleys less deep than this part of the approach are pressed flat.
const DEPTH: f64 = 0.05;
/// More patches than this are not told apart by any grid.
const SUMMITS_MAX: usize = 48;
/// Half-length of the contact over that of the box it is looked for in, which is made for 1.3 times the approach: Hertz's edge
/// lies where the gap is half the approach.
const CONTACT_OVER_BOX: f64 = 0.62;

impl GapTask {
    /// What the contact will be like: its size, and how many asperities touch, with valleys between them that are not pressed flat.
    pub fn preview(&self) -> GapPreview {
        *self.seen.preview.get_or_make(|| self.look())
    }

    /// The box in which contact can be.
    pub(crate) fn reach(&self) -> SearchBox {
        let found = || reach(&self.gap, self.loading, self.contact_modulus);
        *self.seen.reach.get_or_make(found)
    }

    fn look(&self) -> GapPreview {
        let reach = self.reach();
        let depth = reach.level - reach.least;
        let samples = self.gap.samples();
        let within = |k: usize| -> Vec<f64> {
            let [low, high] = reach.window[k];
            let inside = samples[k].iter().filter(|at| (low..=high).contains(*at));
            inside.copied().collect()
        };
        let middle = |k: usize| [0.5 * (reach.window[k][0] + reach.window[k][1])];
        // Along the middle line of either axis.
        let (x, y) = (within(0), within(1));
        let lines = [self.gap.on(&x, &middle(1)), self.gap.on(&middle(0), &y)];
        let asperities = lines
            .iter()
            .map(|line| valleys(line, reach.level, DEPTH * depth))
            .max();
        GapPreview {
            half: reach
                .window
                .map(|[low, high]| 0.5 * CONTACT_OVER_BOX * (high - low)),
            depth,
            asperities: asperities.unwrap_or(1).clamp(1, SUMMITS_MAX),
        }
    }
}

/// Valleys of a line whose bottom is below a level, with ridges between them that are higher than both by a depth.
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

/// Points of a box along each axis when it is looked through. With 24 a gap of a few bumps has a force that is 8 % off.
const POINTS: usize = 48;
/// Most samples along one axis that are evaluated one by one; of more samples, only every second or third is.
const SAMPLES_MAX: usize = 400;
/// Most boxes that are tried until one is filled; each try shrinks a box that is too large at least by half.
const BOXES_TRIED_MAX: usize = 40;
/// A box is filled if the region found takes this fraction of it along both axes. Chosen by judgement; how much it matters was not measured.
const FILLED: f64 = 0.5;
/// Factor on the estimated approach: on smooth gaps it was never too small by more. If it is, the solution shows it and the box grows.
const MARGIN: f64 = 1.3;

/// A box of the contact plane and the depth of overlap it was made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchBox {
    pub(crate) window: Window,
    /// No point outside the window has a gap of less than this, in mm (as far as the data go).
    pub(crate) level: f64,
    /// The least gap found, in mm.
    pub(crate) least: f64,
}

/// The points at which a gap is evaluated, and its values there.
struct GapSamples {
    axes: [Vec<f64>; 2],
    values: Vec<f64>,
    least: f64,
}

/// The box in which contact can be under this load, found by evaluating the gap.
///
/// Contact lies where the gap is smaller than the approach, whatever the pressure. The approach belonging to a force is
/// estimated as if the region overlapping by half of it were a circle of the same area pressed by a sphere, which is
/// exact for a paraboloid: `N = 4/3 E* √(A/π) δ` with A the area where the gap is less than `δ/2` above its least value.
pub(crate) fn reach(gap: &GapSurface, loading: NormalLoad, contact_modulus: f64) -> SearchBox {
    let limits = gap.window();
    let mut window = first_box(gap);
    let mut level = f64::INFINITY;
    let mut least = f64::INFINITY;
    for _ in 0..BOXES_TRIED_MAX {
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

/// The whole window; where a formula holds, as far as the gap exceeds all that the samples tell.
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

    /// Estimated approach above the least gap, for the force divided by the contact modulus.
    fn depth(&self, force: f64) -> f64 {
        let shares = [0, 1].map(|k| shares(&self.axes[k]));
        let width = self.axes[0].len();
        let mut cells: Vec<(f64, f64)> = self
            .values
            .iter()
            .enumerate()
            .map(|(k, value)| {
                (
                    value - self.least,
                    shares[0][k % width] * shares[1][k / width],
                )
            })
            .collect();
        let carried =
            |area: f64, depth: f64| 4.0 / 3.0 * (area / std::f64::consts::PI).sqrt() * depth;
        // The least height at which the force is carried, by halves: lower ones to the front, as a sort would, but only
        // in the half that holds the answer.
        let (mut area, mut rest) = (0.0, &mut cells[..]);
        while rest.len() > 1 {
            let middle = rest.len() / 2;
            rest.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0));
            let (lower, upper) = rest.split_at_mut(middle);
            let highest = lower.iter().map(|cell| cell.0).fold(0.0, f64::max);
            let whole = area + lower.iter().map(|cell| cell.1).sum::<f64>();
            if carried(whole, 2.0 * highest) >= force {
                rest = lower;
            } else {
                (area, rest) = (whole, upper);
            }
        }
        let (height, share) = rest[0];
        area += share;
        if carried(area, 2.0 * height) >= force {
            2.0 * height
        } else {
            force / carried(area, 1.0)
        }
    }

    /// The box around all points with a gap below a level, one point wider on every side; around the deepest point if
    /// there is none.
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

/// Points of a range with both ends: the samples in it, or equally many everywhere if there are too few.
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

/// Length of the axis that each of its points stands for.
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
