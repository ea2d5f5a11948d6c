//! Curves through samples: a cubic in every interval, with slopes at the nodes that the functions here choose by different rules.

use crate::contact::numerics::cubic::interval;

/// Value of the curve with these values and slopes at the nodes of an ascending axis, at least 2; beyond its ends that of the
/// outermost cubics.
pub(crate) fn value(axis: &[f64], values: &[f64], slopes: &[f64], at: f64) -> f64 {
    Place::new(axis, at).value(values, slopes)
}

/// A place on an axis, found once for the curves of many rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The node at the start of its interval.
    pub(crate) node: usize,
    /// Weights of the values at both ends of the interval in the curve's value.
    pub(crate) values: [f64; 2],
    /// Weights of the slopes there.
    pub(crate) slopes: [f64; 2],
}

impl Place {
    /// A place on an ascending axis of at least 2 nodes; beyond the ends it is counted from the outermost intervals.
    pub(crate) fn new(axis: &[f64], at: f64) -> Place {
        let node = interval(axis, at);
        let length = axis[node + 1] - axis[node];
        let share = (at - axis[node]) / length;
        let rest = 1.0 - share;
        let end = share * share * (3.0 - 2.0 * share);
        Place {
            node,
            values: [1.0 - end, end],
            slopes: [length * share * rest * rest, -length * share * share * rest],
        }
    }

    /// Value of the curve with these values and slopes at the nodes.
    pub(crate) fn value(&self, values: &[f64], slopes: &[f64]) -> f64 {
        let [start, end] = self.values;
        let [leaving, arriving] = self.slopes;
        let next = self.node + 1;
        start * values[self.node]
            + end * values[next]
            + (leaving * slopes[self.node] + arriving * slopes[next])
    }
}

/// Values at any places of the curve that has no extreme between its nodes (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat.
/// Comput. 5, 1984); beyond the first and last node their values. Nodes ascend; none of two at the same place counts twice.
pub(crate) fn monotone(axis: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let last = axis.len() - 1;
    if last == 0 {
        return vec![values[0]; at.len()];
    }
    let slopes = monotone_slopes(axis, values);
    let value_at = |place: &f64| {
        let place = place.clamp(axis[0], axis[last]);
        let i = interval(axis, place);
        if axis[i + 1] > axis[i] {
            value(axis, values, &slopes, place)
        } else {
            values[i]
        }
    };
    at.iter().map(value_at).collect()
}

/// Slopes after Fritsch and Butland: weighted harmonic means inside, parabolas at both ends, kept from overshooting.
fn monotone_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let last = axis.len() - 1;
    let widths: Vec<f64> = axis.windows(2).map(|k| k[1] - k[0]).collect();
    let secants: Vec<f64> = (0..last)
        .map(|k| {
            let rise = values[k + 1] - values[k];
            if widths[k] > 0.0 {
                rise / widths[k]
            } else {
                0.0
            }
        })
        .collect();
    let end = |near: usize, next: usize| {
        let (h, g) = (widths[near], widths[next]);
        if h + g <= 0.0 {
            return 0.0;
        }
        let slope = ((2.0 * h + g) * secants[near] - h * secants[next]) / (h + g);
        if slope * secants[near] <= 0.0 {
            0.0
        } else if slope.abs() > 3.0 * secants[near].abs() {
            3.0 * secants[near]
        } else {
            slope
        }
    };
    let mut slopes = vec![secants[0]; last + 1];
    if last > 1 {
        slopes[0] = end(0, 1);
        slopes[last] = end(last - 1, last - 2);
    }
    for k in 1..last {
        let (before, after) = (secants[k - 1], secants[k]);
        slopes[k] = if before * after > 0.0 {
            let (w1, w2) = (
                2.0 * widths[k] + widths[k - 1],
                widths[k] + 2.0 * widths[k - 1],
            );
            (w1 + w2) / (w1 / before + w2 / after)
        } else {
            0.0
        };
    }
    slopes
}

/// How many nodes away the last value lies that a slope of [`limited_slopes`] depends on.
pub(crate) const SLOPE_REACH: usize = 2;

/// Slopes at the nodes of a curve through at least 2 values, limited where the values jump or have a kink.
///
/// A slope is that of the parabola through the node and its two neighbours, unless this parabola is curved more than a fixed
/// number of times as strongly as those of both neighbouring nodes. There the slope is blended with the harmonic mean of the
/// adjoining chords' slopes, 0 where these differ in sign (the limiter of van Leer 1974), which keeps the curve from overshooting
/// the values. At the ends the parabola of the adjacent node is used. A slope inside depends on [`SLOPE_REACH`] values on either side.
pub(crate) fn limited_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let mut slopes = LimitedSlopes::new(axis);
    slopes.find(values);
    slopes.slopes
}

/// [`limited_slopes`] of one curve after the other over the same axis.
#[derive(Debug)]
pub(crate) struct LimitedSlopes {
    /// One over the distance from every node to the next.
    per_width: Vec<f64>,
    /// Of every node but the outermost, two over the distance from the one before it to the one after it.
    bend: Vec<f64>,
    /// The weights of the chords before and after such a node in the slope of its parabola.
    weights: Vec<[f64; 2]>,
    rises: Vec<f64>,
    /// Second derivatives of the parabolas; the outermost two have those of their neighbours.
    bends: Vec<f64>,
    /// Those of the last curve.
    pub(crate) slopes: Vec<f64>,
}

impl LimitedSlopes {
    /// For curves over an ascending axis of at least 2 nodes.
    pub(crate) fn new(axis: &[f64]) -> LimitedSlopes {
        let around = || {
            axis.windows(3)
                .map(|at| ([at[2] - at[1], at[1] - at[0]], at[2] - at[0]))
        };
        LimitedSlopes {
            per_width: axis.windows(2).map(|at| 1.0 / (at[1] - at[0])).collect(),
            bend: around().map(|(_, both)| 2.0 / both).collect(),
            weights: around()
                .map(|(parts, both)| parts.map(|part| part / both))
                .collect(),
            rises: Vec::with_capacity(axis.len()),
            bends: Vec::with_capacity(axis.len()),
            slopes: Vec::with_capacity(axis.len()),
        }
    }

    /// Finds the slopes of a curve.
    pub(crate) fn find(&mut self, values: &[f64]) {
        let n = values.len();
        self.rises.clear();
        let chords = values.windows(2).zip(&self.per_width);
        self.rises
            .extend(chords.map(|(ends, per_width)| (ends[1] - ends[0]) * per_width));
        self.slopes.clear();
        if n == 2 {
            self.slopes.resize(n, self.rises[0]);
            return;
        }
        let pairs = || self.rises.windows(2);
        self.bends.clear();
        self.bends.push(0.0);
        let bends = pairs().zip(&self.bend);
        self.bends
            .extend(bends.map(|(rise, per)| (rise[1] - rise[0]) * per));
        self.bends.push(self.bends[n - 2]);
        self.bends[0] = self.bends[1];
        self.slopes.push(0.0);
        let parabolas = pairs().zip(&self.weights);
        self.slopes
            .extend(parabolas.map(|(rise, [before, after])| before * rise[0] + after * rise[1]));
        for k in 1..n - 1 {
            let trust = self.trust(k);
            if trust < 1.0 {
                let (before, after) = (self.rises[k - 1], self.rises[k]);
                let steepness = before.abs() + after.abs();
                let mean = (before * after.abs() + after * before.abs()) / steepness;
                self.slopes[k] = trust * self.slopes[k] + (1.0 - trust) * mean;
            }
        }
        let end = |node: usize, chord: usize| {
            0.5 * self.trust(node) * self.bends[node] / self.per_width[chord]
        };
        let (first, last) = (end(1, 0), end(n - 2, n - 2));
        self.slopes[0] = self.rises[0] - first;
        self.slopes.push(self.rises[n - 2] + last);
    }

    /// Share of the parabola in the slope at a node that is not the first or last.
    fn trust(&self, k: usize) -> f64 {
        /// How many times as strongly a parabola may be curved as its neighbours. Chosen by judgement; how much it matters was not measured.
        const SLOPE_LIMIT: f64 = 8.0;
        let bend = self.bends[k].abs();
        let allowed = SLOPE_LIMIT * self.bends[k - 1].abs().min(self.bends[k + 1].abs());
        if bend <= allowed { 1.0 } else { allowed / bend }
    }
}

/// Slopes that favour the straighter side, so that the curve stays close to the chords where a spline overshoots (H. Akima, Journal of
/// the ACM 17, 1970). At least 2 nodes, ascending.
pub(crate) fn akima_slopes(axis: &[f64], values: &[f64]) -> Vec<f64> {
    let count = axis.len();
    // Slopes of the chords, with two more beyond either end that go on in a straight line.
    let mut chords = vec![0.0; count + 3];
    for k in 0..count - 1 {
        chords[k + 2] = (values[k + 1] - values[k]) / (axis[k + 1] - axis[k]);
    }
    for k in [1, 0] {
        chords[k] = 2.0 * chords[k + 1] - chords[k + 2];
    }
    for k in [count + 1, count + 2] {
        chords[k] = 2.0 * chords[k - 1] - chords[k - 2];
    }
    (0..count)
        .map(|k| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|j| chords[k + j]);
            let (before, after) = ((b - a).abs(), (d - c).abs());
            if before + after > 0.0 {
                (after * b + before * c) / (before + after)
            } else {
                0.5 * (b + c)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_passed_without_overshoot_and_lines_are_kept() {
        let at: Vec<f64> = (0..=50).map(|k| f64::from(k) * 0.1).collect();
        let knots = [0.0, 1.0, 1.5, 3.0, 5.0];
        let step = monotone(&knots, &[0.0, 0.0, 1.0, 1.0, 1.0], &at);
        assert!(step.iter().all(|v| (0.0..=1.0).contains(v)), "{step:?}");
        assert!(step.is_sorted_by(|a, b| a <= b));
        let line = monotone(&knots, &knots.map(|k| 2.0 * k - 3.0), &at);
        for (place, value) in at.iter().zip(line) {
            assert!((value - (2.0 * place - 3.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn akima_leaves_a_line_straight_up_to_where_it_bends() {
        let axis: Vec<f64> = (0..10).map(f64::from).collect();
        let values = axis.clone().into_iter().map(|x| (x - 5.0).max(0.0));
        let values: Vec<f64> = values.collect();
        let slopes = akima_slopes(&axis, &values);
        for (k, slope) in slopes.iter().enumerate() {
            let expected = [0.0, 1.0][usize::from(k > 5)];
            assert!(k == 5 || (slope - expected).abs() < 1e-12, "{slopes:?}");
        }
        for k in [0.3, 2.5, 3.9] {
            assert!(value(&axis, &values, &slopes, k).abs() < 1e-12);
        }
    }

    #[test]
    fn limited_slopes_are_those_of_parabolas_unless_the_values_jump() {
        let axis = [0.0, 1.0, 1.5, 3.0, 5.0, 6.0];
        let parabola = limited_slopes(&axis, &axis.map(|x| 1.0 + x * (0.5 - x)));
        for (x, slope) in axis.iter().zip(parabola) {
            assert!((slope - (0.5 - 2.0 * x)).abs() < 1e-12);
        }
        let step = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let axis: Vec<f64> = (0..6).map(f64::from).collect();
        let slopes = limited_slopes(&axis, &step);
        for k in 0..50 {
            let found = value(&axis, &step, &slopes, 0.1 * f64::from(k));
            assert!((-0.1..1.1).contains(&found), "{found}");
        }
    }
}
