//! The gap between the undeformed bodies: samples, and a smooth surface through them.

use crate::contact::normal::interpolation::{interval, weights};

/// Distance of the undeformed surfaces in mm, both bodies together, over the contact plane.
#[derive(Debug, Clone, PartialEq)]
pub enum Gap {
    /// `h = x²/(2 rolling) + across(y)`.
    Profile {
        /// Relative radius in the rolling direction in mm.
        rolling: f64,
        /// The gap at x = 0.
        across: Curve,
    },
    /// Any surface, given on a rectangular grid.
    Grid(Surface),
}

/// A curve with a continuous derivative through samples; parabolas are reproduced exactly.
///
/// Beyond the first and the last sample there is nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    axis: Axis,
    /// Values at the nodes of the axis, the two added ones included.
    values: Vec<f64>,
}

/// A surface with continuous derivatives through samples on a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    x: Axis,
    y: Axis,
    /// Values at the nodes, the added ones included; node (i, j) at `j * x.nodes.len() + i`.
    values: Vec<f64>,
}

/// Coordinates of samples, with one node added on each side: the interpolation needs two neighbours everywhere.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    nodes: Vec<f64>,
}

/// Where the gap is known, `[low, high]` in mm along x and y; infinite where it is given by a formula.
pub type Window = [[f64; 2]; 2];

impl Gap {
    /// The gap of a cross-section `(y, gap)` that rolls on a circle; at least 2 samples, y increasing.
    #[must_use]
    pub fn profile(rolling: f64, y: &[f64], gap: &[f64]) -> Gap {
        Gap::Profile {
            rolling,
            across: Curve::new(y, gap),
        }
    }

    /// The gap `gap[j][i]` at `(x[i], y[j])`; at least 2 samples along either axis, axes increasing.
    #[must_use]
    pub fn grid(x: &[f64], y: &[f64], gap: &[Vec<f64>]) -> Gap {
        Gap::Grid(Surface::new(x, y, gap))
    }

    /// Where the gap is known.
    #[must_use]
    pub fn window(&self) -> Window {
        match self {
            Gap::Profile { across, .. } => {
                [[f64::NEG_INFINITY, f64::INFINITY], across.axis.range()]
            }
            Gap::Grid(surface) => [surface.x.range(), surface.y.range()],
        }
    }

    /// Coordinates of the samples along x and y, without the added nodes; none where a formula holds.
    #[must_use]
    pub fn samples(&self) -> [&[f64]; 2] {
        match self {
            Gap::Profile { across, .. } => [&[], across.axis.given()],
            Gap::Grid(surface) => [surface.x.given(), surface.y.given()],
        }
    }

    /// Values at all `(x[i], y[j])`, stored at `j * x.len() + i`. All points lie in the window.
    #[must_use]
    pub fn on(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        match self {
            Gap::Profile { rolling, across } => {
                let along: Vec<f64> = x.iter().map(|x| 0.5 * x * x / rolling).collect();
                y.iter()
                    .flat_map(|y| {
                        let across = across.at(*y);
                        along.iter().map(move |along| along + across)
                    })
                    .collect()
            }
            Gap::Grid(surface) => surface.on(x, y),
        }
    }

    /// The least and the largest sample; along x = 0 for a profile.
    #[must_use]
    pub fn extremes(&self) -> [f64; 2] {
        let given: Box<dyn Iterator<Item = f64> + '_> = match self {
            Gap::Profile { across, .. } => {
                Box::new(across.values[1..across.values.len() - 1].iter().copied())
            }
            Gap::Grid(surface) => {
                let width = surface.x.nodes.len();
                let rows = surface.values.chunks_exact(width);
                Box::new(
                    rows.skip(1)
                        .take(surface.y.nodes.len() - 2)
                        .flat_map(move |row| row[1..width - 1].iter().copied()),
                )
            }
        };
        given.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    }

    /// Is the gap its own mirror image about y = 0, sample by sample?
    #[must_use]
    pub fn is_mirrored(&self) -> bool {
        let mirrored = |axis: &Axis| {
            let nodes = &axis.nodes;
            nodes.iter().zip(nodes.iter().rev()).all(|(a, b)| *a == -b)
        };
        match self {
            Gap::Profile { across, .. } => {
                let values = &across.values;
                mirrored(&across.axis) && values.iter().zip(values.iter().rev()).all(|(a, b)| a == b)
            }
            Gap::Grid(surface) => {
                let rows = surface.values.chunks_exact(surface.x.nodes.len());
                mirrored(&surface.y) && rows.clone().zip(rows.rev()).all(|(a, b)| a == b)
            }
        }
    }
}

impl Axis {
    fn new(given: &[f64]) -> Axis {
        let n = given.len();
        let mut nodes = Vec::with_capacity(n + 2);
        nodes.push(2.0 * given[0] - given[1]);
        nodes.extend_from_slice(given);
        nodes.push(2.0 * given[n - 1] - given[n - 2]);
        Axis { nodes }
    }

    fn given(&self) -> &[f64] {
        &self.nodes[1..self.nodes.len() - 1]
    }

    fn range(&self) -> [f64; 2] {
        let given = self.given();
        [given[0], given[given.len() - 1]]
    }

    /// The interval that holds a point, and the weights of the four nodes around it.
    fn weights(&self, at: f64) -> (usize, [f64; 4]) {
        let i = interval(&self.nodes, at).clamp(1, self.nodes.len() - 3);
        (i - 1, weights(&self.nodes, i, at))
    }

    /// Value at the added node before (`first`) or after the given ones: on the parabola through the three nearest
    /// samples, on the line if there are only two.
    fn beyond(&self, first: bool, value: impl Fn(usize) -> f64) -> f64 {
        let n = self.nodes.len();
        let near = |k: usize| if first { k } else { n - 1 - k };
        let [x0, x1, x2] = [0, 1, 2].map(|k| self.nodes[near(k)]);
        let [v1, v2] = [1, 2].map(|k| value(near(k)));
        let line = v1 + (v2 - v1) * (x0 - x1) / (x2 - x1);
        if n < 5 {
            return line;
        }
        let (x3, v3) = (self.nodes[near(3)], value(near(3)));
        let slopes = [(v2 - v1) / (x2 - x1), (v3 - v2) / (x3 - x2)];
        line + (slopes[1] - slopes[0]) / (x3 - x1) * (x0 - x1) * (x0 - x2)
    }
}

impl Curve {
    fn new(given: &[f64], samples: &[f64]) -> Curve {
        let axis = Axis::new(given);
        let mut values = Vec::with_capacity(samples.len() + 2);
        values.push(0.0);
        values.extend_from_slice(samples);
        values.push(0.0);
        values[0] = axis.beyond(true, |k| values[k]);
        let last = axis.beyond(false, |k| values[k]);
        values[samples.len() + 1] = last;
        Curve { axis, values }
    }

    fn at(&self, at: f64) -> f64 {
        let (first, weights) = self.axis.weights(at);
        dot(weights, &self.values[first..first + 4])
    }
}

impl Surface {
    fn new(x: &[f64], y: &[f64], samples: &[Vec<f64>]) -> Surface {
        let (x, y) = (Axis::new(x), Axis::new(y));
        let width = x.nodes.len();
        let mut values = vec![0.0; width * y.nodes.len()];
        for (row, samples) in values[width..].chunks_exact_mut(width).zip(samples) {
            row[1..width - 1].copy_from_slice(samples);
            row[0] = x.beyond(true, |k| row[k]);
            row[width - 1] = x.beyond(false, |k| row[k]);
        }
        let last = (y.nodes.len() - 1) * width;
        for i in 0..width {
            values[i] = y.beyond(true, |k| values[k * width + i]);
            values[last + i] = y.beyond(false, |k| values[k * width + i]);
        }
        Surface { x, y, values }
    }

    fn on(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let width = self.x.nodes.len();
        let places: Vec<(usize, [f64; 4])> = x.iter().map(|x| self.x.weights(*x)).collect();
        // Only the columns that some point needs are brought to a line.
        let low = places.iter().map(|(first, _)| *first).min().unwrap_or(0);
        let high = places.iter().map(|(first, _)| first + 4).max().unwrap_or(0);
        let mut line = vec![0.0; width];
        let mut out = Vec::with_capacity(x.len() * y.len());
        for y in y {
            let (first, weights) = self.y.weights(*y);
            let row = |k: usize| &self.values[(first + k) * width..(first + k + 1) * width];
            let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
            for i in low..high {
                line[i] = dot(weights, &[a[i], b[i], c[i], d[i]]);
            }
            out.extend(
                places
                    .iter()
                    .map(|(first, weights)| dot(*weights, &line[*first..first + 4])),
            );
        }
        out
    }
}

fn dot(weights: [f64; 4], values: &[f64]) -> f64 {
    weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] + weights[3] * values[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paraboloid(x: f64, y: f64) -> f64 {
        0.01 * x * x + 0.02 * y * y + 0.003 * x * y - 0.1 * x + 0.05
    }

    fn sampled(x: &[f64], y: &[f64]) -> Gap {
        let rows: Vec<Vec<f64>> = y
            .iter()
            .map(|y| x.iter().map(|x| paraboloid(*x, *y)).collect())
            .collect();
        Gap::grid(x, y, &rows)
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
                assert!((found - paraboloid(*x, *y)).abs() < 1e-14, "{x} {y} {found}");
            }
        }
    }

    #[test]
    fn two_samples_make_a_line() {
        let gap = Gap::profile(500.0, &[1.0, 3.0], &[0.2, 0.6]);
        let found = gap.on(&[0.0, 10.0], &[2.5]);
        assert!((found[0] - 0.5).abs() < 1e-15 && (found[1] - 0.6).abs() < 1e-15);
        assert_eq!(gap.extremes(), [0.2, 0.6]);
    }

    #[test]
    fn mirror_images_are_recognised_sample_by_sample() {
        let y = [-2.0, -0.5, 0.5, 2.0];
        assert!(Gap::profile(1.0, &y, &[1.0, 0.0, 0.0, 1.0]).is_mirrored());
        assert!(!Gap::profile(1.0, &y, &[1.0, 0.0, 1e-9, 1.0]).is_mirrored());
        assert!(!Gap::profile(1.0, &[-2.0, -0.5, 0.6, 2.0], &[1.0, 0.0, 0.0, 1.0]).is_mirrored());
        let x = [0.0, 1.0];
        let rows = |last: f64| vec![vec![3.0, 1.0], vec![0.0, 0.5], vec![3.0, last]];
        assert!(Gap::grid(&x, &[-1.0, 0.0, 1.0], &rows(1.0)).is_mirrored());
        assert!(!Gap::grid(&x, &[-1.0, 0.0, 1.0], &rows(1.1)).is_mirrored());
    }
}
