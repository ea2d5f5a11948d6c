//! Squared pressure along a straight grid-parallel line: where it is positive.

use crate::contact::normal::prescribed::interpolation::Cubic;

/// Which way a line runs.
#[derive(Debug, Clone, Copy)]
pub(super) enum Direction {
    /// Along x, at a given y.
    Rolling,
    /// Along y, at a given x.
    Across,
}

/// Values at the nodes of an axis, and the intervals that may belong to a patch.
#[derive(Debug)]
pub(super) struct Line<'f> {
    pub(super) axis: &'f [f64],
    /// Node of the axis that `values` starts with.
    pub(super) first: usize,
    pub(super) values: Vec<f64>,
    /// For each interval from the second node on: may it belong to the patch?
    pub(super) open: Vec<bool>,
}

/// A cubic that does not become negative between two positive ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Floored {
    cubic: Cubic,
    floor: f64,
}

impl Line<'_> {
    /// A line that misses everything.
    pub(super) fn empty(axis: &[f64]) -> Line<'_> {
        Line {
            axis,
            first: 0,
            values: Vec::new(),
            open: Vec::new(),
        }
    }

    /// The segments where the curve is positive, from smaller to larger coordinate.
    pub(super) fn segments(&self) -> Vec<(f64, f64)> {
        let mut segments = Vec::new();
        let mut start = None;
        for (k, open) in self.open.iter().enumerate() {
            let node = self.first + 1 + k;
            let (here, next) = (self.values[k + 1], self.values[k + 2]);
            if *open {
                if here > 0.0 && start.is_none() {
                    start = Some(self.axis[node]);
                }
                let values = [self.values[k], here, next, self.values[k + 3]];
                // Between two positive nodes the contact is whole: a gap there is not in the data.
                if here <= 0.0 || next <= 0.0 {
                    for (at, positive) in Cubic::between(self.axis, node, values).sign_changes() {
                        if positive {
                            start.get_or_insert(at);
                        } else if let Some(start) = start.take() {
                            segments.push((start, at));
                        }
                    }
                }
            } else if let Some(start) = start.take() {
                segments.push((start, self.axis[node]));
            }
        }
        if let Some(start) = start {
            segments.push((start, self.axis[self.first + 1 + self.open.len()]));
        }
        segments.retain(|(left, right)| right > left);
        segments
    }
}

/// The curve between nodes `i` and `i + 1` of the axis.
pub(super) fn cubic(axis: &[f64], i: usize, value: impl Fn(usize) -> f64) -> Floored {
    let values: [f64; 4] = std::array::from_fn(|k| value(i - 1 + k));
    Floored {
        cubic: Cubic::between(axis, i, values),
        floor: floor(values[1], values[2]),
    }
}

/// Least value between two nodes: a quarter of the lower one if both are positive, else no bound.
pub(super) fn floor(left: f64, right: f64) -> f64 {
    let lower = left.min(right);
    if lower > 0.0 {
        0.25 * lower
    } else {
        f64::NEG_INFINITY
    }
}

impl Floored {
    /// Value at x, never negative.
    pub(super) fn at(&self, x: f64) -> f64 {
        self.cubic.at(x).max(self.floor).max(0.0)
    }
}
