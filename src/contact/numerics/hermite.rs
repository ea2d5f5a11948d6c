//! Curves through samples: a cubic in every interval, with slopes at the nodes that the functions here choose by different rules.

use crate::contact::numerics::cubic::{Cubic, interval};

/// Value of the curve with these values and slopes at the nodes of an ascending axis, at least 2; beyond its ends that of the
/// outermost cubics.
pub(crate) fn value(axis: &[f64], values: &[f64], slopes: &[f64], at: f64) -> f64 {
    let Place { node, share } = Place::new(axis, at);
    let ends = |of: &[f64]| [of[node], of[node + 1]];
    Cubic::with_slopes(axis, node, ends(values), ends(slopes)).value(share)
}

/// A place on an axis, found once for the curves of many rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The node at the start of its interval.
    pub(crate) node: usize,
    /// How far along the interval it lies: 0 at its start, 1 at its end.
    pub(crate) share: f64,
}

impl Place {
    /// A place on an ascending axis of at least 2 nodes; beyond the ends it is counted from the outermost intervals.
    pub(crate) fn new(axis: &[f64], at: f64) -> Place {
        let node = interval(axis, at);
        Place {
            node,
            share: (at - axis[node]) / (axis[node + 1] - axis[node]),
        }
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
    let mut slopes = LimitedSlopes::default();
    slopes.find(axis, values);
    slopes.slopes
}

/// [`limited_slopes`] of one curve after the other, with room that is kept.
#[derive(Debug, Default)]
pub(crate) struct LimitedSlopes {
    rises: Vec<f64>,
    bends: Vec<f64>,
    /// Those of the last curve.
    pub(crate) slopes: Vec<f64>,
}

impl LimitedSlopes {
    /// Finds the slopes of a curve.
    pub(crate) fn find(&mut self, axis: &[f64], values: &[f64]) {
        /// How many times as strongly a parabola may be curved as its neighbours. Chosen by judgement; how much it matters was not measured.
        const SLOPE_LIMIT: f64 = 8.0;
        let n = axis.len();
        let LimitedSlopes {
            rises,
            bends,
            slopes,
        } = self;
        rises.clear();
        rises.extend((1..n).map(|k| (values[k] - values[k - 1]) / (axis[k] - axis[k - 1])));
        slopes.clear();
        slopes.resize(n, rises[0]);
        if n == 2 {
            return;
        }
        // The outermost two have those of their neighbours.
        bends.clear();
        bends.push(0.0);
        bends.extend(
            (1..n - 1).map(|k| 2.0 * (rises[k] - rises[k - 1]) / (axis[k + 1] - axis[k - 1])),
        );
        bends.push(bends[n - 2]);
        bends[0] = bends[1];
        let allowed = |k: usize| {
            SLOPE_LIMIT
                * bends[k.saturating_sub(1)]
                    .abs()
                    .min(bends[(k + 1).min(n - 1)].abs())
        };
        // Share of the parabola in a slope.
        let trust = |k: usize| {
            let (bend, allowed) = (bends[k].abs(), allowed(k));
            if bend <= allowed { 1.0 } else { allowed / bend }
        };
        let slope = |k: usize| {
            let (before, after) = (rises[k - 1], rises[k]);
            let widths = [axis[k] - axis[k - 1], axis[k + 1] - axis[k]];
            let parabola = (before * widths[1] + after * widths[0]) / (widths[0] + widths[1]);
            let trust = trust(k);
            if trust == 1.0 {
                return parabola;
            }
            let steepness = before.abs() + after.abs();
            let mean = (before * after.abs() + after * before.abs()) / steepness;
            trust * parabola + (1.0 - trust) * mean
        };
        for (k, value) in slopes.iter_mut().enumerate().take(n - 1).skip(1) {
            *value = slope(k);
        }
        slopes[0] = rises[0] - 0.5 * trust(1) * bends[1] * (axis[1] - axis[0]);
        slopes[n - 1] =
            rises[n - 2] + 0.5 * trust(n - 2) * bends[n - 2] * (axis[n - 1] - axis[n - 2]);
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
