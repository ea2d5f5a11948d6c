//! The gap between the undeformed bodies: a smooth surface through samples.

use crate::numerics::interpolation::{LimitedSlopes, Place, SLOPE_REACH, limited_slopes};

/// Distance of the undeformed surfaces in mm, both bodies together, over the contact plane.
#[derive(Debug, Clone, PartialEq)]
pub enum GapSurface {
    /// `h = x²/(2 rolling) + across(y)`.
    Profile {
        /// Relative radius in the rolling direction in mm.
        rolling: f64,
        /// The gap at x = 0.
        across: GapCurve,
    },
    /// Any surface, given on a rectangular grid.
    Grid(SampledSurface),
    /// Another gap plus a small change, which is constant beyond its grid.
    Changed {
        /// The other gap.
        gap: Box<GapSurface>,
        /// The change.
        change: SampledSurface,
    },
}

/// A curve with a continuous derivative through samples, which reproduces parabolas exactly. It ends at the first and the last sample.
#[derive(Debug, Clone, PartialEq)]
pub struct GapCurve {
    axis: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

/// A surface with continuous derivatives through samples on a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledSurface {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Sample (i, j) at `j * x.len() + i`.
    values: Vec<f64>,
    /// Slopes along y, stored alike.
    slopes: Vec<f64>,
}

/// Where the gap is known, `[low, high]` in mm along x and y; infinite where it is given by a formula.
pub type Window = [[f64; 2]; 2];

/// Width of the margin of [`around`] over the extent. Chosen by judgement.
const AROUND: f64 = 0.25;

/// Sample points over an extent and a margin around it, within the limits of the data.
pub(crate) fn around([low, high]: [f64; 2], [least, most]: [f64; 2], samples: usize) -> Vec<f64> {
    let margin = AROUND * (high - low);
    let (low, high) = ((low - margin).max(least), (high + margin).min(most));
    let step = (high - low) / (samples - 1) as f64;
    (0..samples).map(|k| low + k as f64 * step).collect()
}

impl GapSurface {
    /// The gap of a cross-section `(y, gap)` that rolls on a circle; at least 2 samples, y increasing.
    pub fn profile(rolling: f64, y: &[f64], gap: &[f64]) -> GapSurface {
        GapSurface::Profile {
            rolling,
            across: GapCurve::new(y, gap),
        }
    }

    /// The gap `gap[j][i]` at `(x[i], y[j])`; at least 2 samples along either axis, axes increasing.
    pub fn grid(x: &[f64], y: &[f64], gap: &[Vec<f64>]) -> GapSurface {
        GapSurface::Grid(SampledSurface::new(x, y, gap))
    }

    /// The gap plus `change[j][i]` at `(x[i], y[j])`; axes as in [`GapSurface::grid`].
    #[must_use]
    pub fn changed(&self, x: &[f64], y: &[f64], change: &[Vec<f64>]) -> GapSurface {
        GapSurface::Changed {
            gap: Box::new(self.clone()),
            change: SampledSurface::new(x, y, change),
        }
    }

    /// The relative radius of a gap that rolls on a circle, in mm.
    pub fn rolling_radius(&self) -> Option<f64> {
        match self {
            GapSurface::Profile { rolling, .. } => Some(*rolling),
            GapSurface::Grid(_) => None,
            GapSurface::Changed { gap, .. } => gap.rolling_radius(),
        }
    }

    /// Where the gap is known.
    pub fn window(&self) -> Window {
        match self {
            GapSurface::Changed { gap, .. } => gap.window(),
            GapSurface::Profile { across, .. } => {
                [[f64::NEG_INFINITY, f64::INFINITY], range(&across.axis)]
            }
            GapSurface::Grid(surface) => [range(&surface.x), range(&surface.y)],
        }
    }

    /// Coordinates of the samples along x and y; empty where a formula holds.
    pub fn samples(&self) -> [&[f64]; 2] {
        match self {
            GapSurface::Changed { gap, .. } => gap.samples(),
            GapSurface::Profile { across, .. } => [&[], &across.axis],
            GapSurface::Grid(surface) => [&surface.x, &surface.y],
        }
    }

    /// Values at all `(x[i], y[j])` in the window, stored at `j * x.len() + i`.
    pub fn on(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        match self {
            GapSurface::Profile { rolling, across } => {
                let along: Vec<f64> = x.iter().map(|x| 0.5 * x * x / rolling).collect();
                y.iter()
                    .flat_map(|y| {
                        let across = across.at(*y);
                        along.iter().map(move |along| along + across)
                    })
                    .collect()
            }
            GapSurface::Grid(surface) => surface.on(x, y),
            GapSurface::Changed { gap, change } => {
                let inside = |at: &[f64], axis: &[f64]| -> Vec<f64> {
                    let [low, high] = range(axis);
                    at.iter().map(|at| at.clamp(low, high)).collect()
                };
                let mut values = gap.on(x, y);
                let changes = change.on(&inside(x, &change.x), &inside(y, &change.y));
                for (value, change) in values.iter_mut().zip(changes) {
                    *value += change;
                }
                values
            }
        }
    }

    /// The smallest and the largest sample, without an added change; of a profile, those at x = 0.
    pub fn extremes(&self) -> [f64; 2] {
        let values = match self {
            GapSurface::Profile { across, .. } => &across.values,
            GapSurface::Grid(surface) => &surface.values,
            GapSurface::Changed { gap, .. } => return gap.extremes(),
        };
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        values.iter().fold(start, |[low, high], value| {
            [low.min(*value), high.max(*value)]
        })
    }

    /// The place of the smallest sample, if it lies at the edge of the data and no inner sample is as small.
    pub fn least_at_edge(&self) -> Option<String> {
        let place = |name: &str, at: f64| format!("{name} = {at} mm");
        let least = self.extremes()[0];
        match self {
            GapSurface::Changed { gap, .. } => gap.least_at_edge(),
            GapSurface::Profile { across, .. } => {
                let last = across.values.len() - 1;
                let inside = (1..last).any(|k| across.values[k] <= least);
                let at = if across.values[0] <= least { 0 } else { last };
                (!inside).then(|| place("y", across.axis[at]))
            }
            GapSurface::Grid(SampledSurface { x, y, values, .. }) => {
                let low = |k: usize| values[k] <= least;
                let at_edge = |k: usize, n: usize| k == 0 || k + 1 == n;
                let cell = |k: usize| (k % x.len(), k / x.len());
                let inside =
                    |k: usize| !at_edge(cell(k).0, x.len()) && !at_edge(cell(k).1, y.len());
                if (0..values.len()).any(|k| low(k) && inside(k)) {
                    return None;
                }
                let (i, j) = (0..values.len()).find(|k| low(*k)).map(cell)?;
                Some(if at_edge(i, x.len()) {
                    place("x", x[i])
                } else {
                    place("y", y[j])
                })
            }
        }
    }

    /// Whether the gap is mirror-symmetric about x = 0 and about y = 0, sample by sample.
    pub fn is_mirrored(&self) -> [bool; 2] {
        let mirrored = |axis: &[f64]| axis.iter().zip(axis.iter().rev()).all(|(a, b)| *a == -b);
        let alike = |values: &[f64]| values.iter().zip(values.iter().rev()).all(|(a, b)| a == b);
        match self {
            GapSurface::Changed { .. } => [false, false],
            GapSurface::Profile { across, .. } => {
                [true, mirrored(&across.axis) && alike(&across.values)]
            }
            GapSurface::Grid(surface) => {
                let mut rows = surface.values.chunks_exact(surface.x.len());
                let images = rows.clone().zip(rows.clone().rev());
                [
                    mirrored(&surface.x) && rows.all(alike),
                    mirrored(&surface.y) && images.into_iter().all(|(a, b)| a == b),
                ]
            }
        }
    }
}

impl GapCurve {
    fn new(axis: &[f64], values: &[f64]) -> GapCurve {
        GapCurve {
            slopes: limited_slopes(axis, values),
            axis: axis.to_vec(),
            values: values.to_vec(),
        }
    }

    fn at(&self, at: f64) -> f64 {
        Place::new(&self.axis, at).value(&self.values, &self.slopes)
    }
}

impl SampledSurface {
    fn new(x: &[f64], y: &[f64], samples: &[Vec<f64>]) -> SampledSurface {
        let mut slopes = vec![0.0; x.len() * y.len()];
        let (mut column, mut across) = (Vec::new(), LimitedSlopes::new(y));
        for i in 0..x.len() {
            column.clear();
            column.extend(samples.iter().map(|row| row[i]));
            across.find(&column);
            for (j, slope) in across.slopes.iter().enumerate() {
                slopes[j * x.len() + i] = *slope;
            }
        }
        SampledSurface {
            x: x.to_vec(),
            y: y.to_vec(),
            values: samples.concat(),
            slopes,
        }
    }

    fn on(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let width = self.x.len();
        let mut places: Vec<Place> = x.iter().map(|x| Place::new(&self.x, *x)).collect();
        // Only these columns affect the values.
        let first = places.iter().map(|place| place.node).min();
        let last = places.iter().map(|place| place.node + 1).max();
        let from = first.unwrap_or(0).saturating_sub(SLOPE_REACH);
        let to = (last.unwrap_or(1) + SLOPE_REACH).min(width - 1);
        places.iter_mut().for_each(|place| place.node -= from);
        let columns = to - from + 1;
        let mut out = Vec::with_capacity(x.len() * y.len());
        let mut line = Vec::with_capacity(columns);
        let mut along = LimitedSlopes::new(&self.x[from..=to]);
        for y in y {
            let across = Place::new(&self.y, *y);
            let ends = [across.node, across.node + 1].map(|j| {
                let row = j * width + from..j * width + to + 1;
                (&self.values[row.clone()], &self.slopes[row])
            });
            let [(start, leaving), (end, arriving)] = ends;
            line.clear();
            line.extend((0..columns).map(|i| {
                across.values[0] * start[i]
                    + across.values[1] * end[i]
                    + (across.slopes[0] * leaving[i] + across.slopes[1] * arriving[i])
            }));
            along.find(&line);
            out.extend(places.iter().map(|place| place.value(&line, &along.slopes)));
        }
        out
    }
}

fn range(axis: &[f64]) -> [f64; 2] {
    [axis[0], axis[axis.len() - 1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paraboloid(x: f64, y: f64) -> f64 {
        0.01 * x * x + 0.02 * y * y + 0.003 * x * y - 0.1 * x + 0.05
    }

    fn sampled(x: &[f64], y: &[f64]) -> GapSurface {
        let rows: Vec<Vec<f64>> = y
            .iter()
            .map(|y| x.iter().map(|x| paraboloid(*x, *y)).collect())
            .collect();
        GapSurface::grid(x, y, &rows)
    }

    #[test]
    fn parabolas_are_reproduced_up_to_the_edge_of_the_window() {
        let x = [-4.0, -2.5, 0.1, 1.0, 3.0];
        let y = [-3.0, 0.0, 2.0];
        let gap = sampled(&x, &y);
        assert_eq!(gap.window(), [[-4.0, 3.0], [-3.0, 2.0]]);
        let at = [-4.0, -3.9, -1.0, 0.5, 2.99, 3.0];
        let across = [-3.0, -1.0, 0.7, 2.0];
        let values = gap.on(&at, &across);
        for (j, y) in across.iter().enumerate() {
            for (i, x) in at.iter().enumerate() {
                let found = values[j * at.len() + i];
                assert!(
                    (found - paraboloid(*x, *y)).abs() < 1e-14,
                    "{x} {y} {found}"
                );
            }
        }
    }

    #[test]
    fn a_part_of_the_window_has_the_values_of_the_whole() {
        // With kinks and jumps, where slopes are limited: equal to the last bit, from wherever the part begins.
        let axis: Vec<f64> = (0..24)
            .map(|k| f64::from(k) + 0.3 * f64::from(k).sin())
            .collect();
        let height = |x: f64, y: f64| (x - 9.0).abs() + if x > 14.5 { 5.0 } else { 0.01 * x * y };
        let rows: Vec<Vec<f64>> = axis
            .iter()
            .map(|y| axis.iter().map(|x| height(*x, *y)).collect())
            .collect();
        let gap = GapSurface::grid(&axis, &axis, &rows);
        let places: Vec<f64> = (0..=115).map(|k| 0.2 * f64::from(k)).collect();
        let across = [0.7, 11.1, 22.9];
        let whole = gap.on(&places, &across);
        for first in 0..places.len() {
            for count in [1, 4, 30] {
                let part = &places[first..(first + count).min(places.len())];
                let found = gap.on(part, &across);
                for (j, row) in found.chunks_exact(part.len()).enumerate() {
                    let known = &whole[j * places.len() + first..];
                    assert_eq!(row, &known[..part.len()], "{first} {count}");
                }
            }
        }
    }

    #[test]
    fn two_samples_make_a_line() {
        let gap = GapSurface::profile(500.0, &[1.0, 3.0], &[0.2, 0.6]);
        let found = gap.on(&[0.0, 10.0], &[2.5]);
        assert!((found[0] - 0.5).abs() < 1e-15 && (found[1] - 0.6).abs() < 1e-15);
        assert_eq!(gap.extremes(), [0.2, 0.6]);
    }

    #[test]
    fn a_jump_does_not_make_the_curve_swing_below_the_samples() {
        let y: Vec<f64> = (-20..=20).map(|k| 0.25 * f64::from(k)).collect();
        let gap: Vec<f64> = y
            .iter()
            .map(|y| if *y > 2.0 { 1e3 } else { 0.002 * y * y })
            .collect();
        let curve = GapSurface::profile(500.0, &y, &gap);
        for k in 0..=1000 {
            let at = -5.0 + 0.01 * f64::from(k);
            let found = curve.on(&[0.0], &[at])[0];
            let parabola = 0.002 * at * at;
            if at <= 1.75 {
                assert!((found - parabola).abs() < 1e-12, "{at} {found}");
            } else {
                assert!(found > parabola - 1e-3, "{at} {found}");
            }
        }
    }

    #[test]
    fn mirror_images_are_recognised_sample_by_sample() {
        let y = [-2.0, -0.5, 0.5, 2.0];
        let profile = |y: &[f64], gap: &[f64]| GapSurface::profile(1.0, y, gap).is_mirrored();
        assert_eq!(profile(&y, &[1.0, 0.0, 0.0, 1.0]), [true, true]);
        assert_eq!(profile(&y, &[1.0, 0.0, 1e-9, 1.0]), [true, false]);
        let askew = [-2.0, -0.5, 0.6, 2.0];
        assert_eq!(profile(&askew, &[1.0, 0.0, 0.0, 1.0]), [true, false]);
        let x = [0.0, 1.0];
        let rows = |last: f64| vec![vec![3.0, 1.0], vec![0.0, 0.5], vec![3.0, last]];
        let grid = |x: &[f64], rows: &[Vec<f64>]| {
            GapSurface::grid(x, &[-1.0, 0.0, 1.0], rows).is_mirrored()
        };
        assert_eq!(grid(&x, &rows(1.0)), [false, true]);
        assert_eq!(grid(&x, &rows(1.1)), [false, false]);
        let even = vec![vec![2.0, 2.0], vec![0.0, 0.0], vec![3.0, 3.0]];
        assert_eq!(grid(&[-1.0, 1.0], &even), [true, false]);
    }
}
