//! Squared pressure, continued beyond the edge of the contact so that its zero locates the edge, and its positive parts along lines of a grid.
//!
//! At the edge of a smooth contact the pressure is proportional to the square root of the distance, and its square q to the distance. Samples outside the contact,
//! where only `p = 0` is known, get negative values extrapolated from inside. For Hertz's pressure q is quadratic and the continuation is exact.

use crate::normal::pressure_field::grid_pressure::SampleGrid;
use crate::numerics::interpolation;
use crate::numerics::roots::Cubic;

/// Number of samples outside with an extrapolated value, counted from the nearest one inside along either axis.
const RINGS: usize = 3;
/// Value of samples farther outside; the largest value inside is 1.
const FAR: f64 = -1.0;
/// The origin of the value of a sample, from least to most reliable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    /// No value yet.
    Unknown,
    /// Continued beyond a jump of pressure with a constant value, because an extrapolated curve would diverge.
    Step,
    /// Continued from fewer than three samples, or limited.
    Rough,
    /// Positive, or continued by a parabola through smooth samples.
    Smooth,
}

/// Replaces the zeros of `q` near positive samples by extrapolated values, which are not positive. `q` is scaled to at most 1 and stored as in [`SampleGrid`]. Returns
/// the state of each sample.
pub(crate) fn extend(grid: &SampleGrid, q: &mut [f64]) -> Vec<State> {
    let state_of = |q: &f64| {
        if *q > 0.0 {
            State::Smooth
        } else {
            State::Unknown
        }
    };
    let mut states: Vec<State> = q.iter().map(state_of).collect();
    let mut missing: Vec<usize> = near_positive(grid, q)
        .into_iter()
        .enumerate()
        .filter_map(|(k, near)| (near && states[k] == State::Unknown).then_some(k))
        .collect();
    let nx = grid.x.len();
    let weights = [&grid.x, &grid.y].map(|axis| parabola_weights(axis));
    // A sample three away along both axes is reached after six steps.
    for pass in 0..2 * RINGS {
        let is_known = |k: usize| states.get(k).is_some_and(|state| *state != State::Unknown);
        let reached = |k: usize| {
            let beside = [k.wrapping_sub(1), k + 1, k.wrapping_sub(nx), k + nx];
            beside.into_iter().any(is_known)
        };
        let found: Vec<_> = missing
            .iter()
            .map(|k| reached(*k).then(|| continued(grid, &weights, q, &states, *k, pass == 0))?)
            .collect();
        let mut left = Vec::new();
        for (k, found) in missing.into_iter().zip(found) {
            if let Some((value, state)) = found {
                (q[k], states[k]) = (value, state);
            } else {
                left.push(k);
            }
        }
        missing = left;
    }
    for (q, state) in q.iter_mut().zip(&states) {
        if *state == State::Unknown {
            *q = FAR;
        }
    }
    states
}

/// Marks the samples with a positive sample at most [`RINGS`] away along x and along y. The padding of the grid is at least as wide, so that
/// no sample is near one at the other end of the next row.
fn near_positive(grid: &SampleGrid, q: &[f64]) -> Vec<bool> {
    let positive: Vec<bool> = q.iter().map(|q| *q > 0.0).collect();
    widened(&widened(&positive, 1), grid.x.len())
}

/// Extends marks by up to [`RINGS`] strides.
fn widened(marked: &[bool], stride: usize) -> Vec<bool> {
    let mut out = marked.to_vec();
    for ring in 1..=RINGS {
        let by = (ring * stride).min(marked.len());
        for (to, from) in out[by..].iter_mut().zip(marked) {
            *to |= *from;
        }
        for (to, from) in out.iter_mut().zip(&marked[by..]) {
            *to |= *from;
        }
    }
    out
}

/// Weights of the three samples before and after a place of an axis for the value of their parabola there.
type ParabolaWeights = [[f64; 3]; 2];

/// The weights of every place of an axis; 0 without three samples on that side.
fn parabola_weights(axis: &[f64]) -> Vec<ParabolaWeights> {
    let of = |at: usize, nodes: [Option<usize>; 3]| {
        let nodes = nodes.map(|node| axis.get(node?).copied());
        match nodes {
            [Some(a), Some(b), Some(c)] => interpolation::polynomial_weights(&[a, b, c], axis[at]),
            _ => [0.0; 3],
        }
    };
    let both = |at: usize| {
        [
            of(at, [1, 2, 3].map(|k| at.checked_sub(k))),
            of(at, [1, 2, 3].map(|k| Some(at + k))),
        ]
    };
    (0..axis.len()).map(both).collect()
}

/// Value of the unknown sample `k` from the most reliable extrapolations along the axes, if there are any. Their harmonic mean prevents the steep edge of a heavily loaded
/// patch from shifting that of a lightly loaded one next to it.
fn continued(
    grid: &SampleGrid,
    weights: &[Vec<ParabolaWeights>; 2],
    q: &[f64],
    states: &[State],
    k: usize,
    first_pass: bool,
) -> Option<(f64, State)> {
    let nx = grid.x.len();
    let (i, j) = (k % nx, k / nx);
    let directions = [
        (&grid.x, i, 1, -1, weights[0][i][0]),
        (&grid.x, i, 1, 1, weights[0][i][1]),
        (&grid.y, j, nx as isize, -1, weights[1][j][0]),
        (&grid.y, j, nx as isize, 1, weights[1][j][1]),
    ];
    let (mut best, mut inverse_sum, mut count, mut state) = (0, 0.0, 0.0, State::Smooth);
    for (axis, at, stride, sign, parabola) in directions {
        // Up to three known samples in this direction, nearest first, as (coordinate, value).
        let mut known = [(0.0, 0.0); 3];
        let mut order = 0;
        let mut worst = State::Smooth;
        while let Some(index) = at.checked_add_signed(sign * (order as isize + 1))
            && order < 3
            && index < axis.len()
        {
            let sample = k.wrapping_add_signed(sign * stride * (order as isize + 1));
            if states[sample] == State::Unknown {
                break;
            }
            known[order] = (axis[index], q[sample]);
            worst = worst.min(states[sample]);
            order += 1;
        }
        if order == 0 || order < best {
            continue;
        }
        if order > best {
            (best, inverse_sum, count, state) = (order, 0.0, 0.0, State::Smooth);
        }
        let by_curve = match known {
            [(_, a), (_, b), (_, c)] if order == 3 => {
                let [wa, wb, wc] = parabola;
                wa * a + wb * b + wc * c
            }
            _ => interpolation::polynomial_value(&known[..order], axis[at]),
        };
        let known = &known[..order];
        let nearest = states[k.wrapping_add_signed(sign * stride)];
        let (value, how) = match nearest {
            State::Step => (known[0].1, State::Step),
            _ if first_pass => edge_value(axis[at], known, by_curve),
            _ => outward_value(known, by_curve),
        };
        // An extrapolated value of 0 has to remain 0 in the mean.
        inverse_sum += 1.0 / value.min(-1e-300);
        count += 1.0;
        state = state.min(how).min(worst.max(State::Rough));
    }
    (best > 0).then_some((count / inverse_sum, state))
}

/// Value of the first sample outside, with its state, from one to three samples inside and the value there of the curve through them.
///
/// The value is not positive, so the edge lies between the last sample inside and the first outside. Where the pressure jumps (the extrapolation is well above 0) the
/// edge is half-way; between the two cases the rule changes smoothly.
fn edge_value(at: f64, inside: &[(f64, f64)], value: f64) -> (f64, State) {
    const EDGE_AT_SAMPLE: f64 = 0.25;
    const JUMP: f64 = 0.75;
    let last = inside[0].1;
    if inside.len() == 1 {
        return (-last, State::Step);
    }
    if value <= 0.0 {
        return (
            value,
            if inside.len() == 3 {
                State::Smooth
            } else {
                State::Rough
            },
        );
    }
    let value = value.min(interpolation::polynomial_value(&inside[..2], at));
    if value <= EDGE_AT_SAMPLE * last {
        return (value.min(0.0), State::Rough);
    }
    let jump = (value / last - EDGE_AT_SAMPLE) / (JUMP - EDGE_AT_SAMPLE);
    (-last * jump.min(1.0), State::Step)
}

/// Value of a sample farther outside, from one to three known ones and the value there of the curve through them. Values do not increase outward.
fn outward_value(known: &[(f64, f64)], value: f64) -> (f64, State) {
    let smooth = known.len() == 3 && value <= known[0].1;
    (
        value.min(known[0].1),
        if smooth { State::Smooth } else { State::Rough },
    )
}

/// A line of a grid: values at its nodes, and the intervals that may belong to a patch. Closures compute values on demand, because most intervals lie inside the contact
/// and need none.
pub(crate) struct GridLine<'f, V, I, S, A> {
    pub(crate) axis: &'f [f64],
    /// The intervals, each numbered by the node at its start. Values of one more node on either side are used as well.
    pub(crate) intervals: std::ops::RangeInclusive<usize>,

    /// The value at a node.
    pub(crate) value: V,
    /// Whether the value at a node is known to be positive.
    pub(crate) inside: I,
    /// Whether the samples around an interval are smooth.
    pub(crate) smooth: S,
    /// The part of an interval that may belong to the patch, from 0 at its start to 1 at its end; it may be empty.
    pub(crate) allowed: A,
}

/// A cubic limited to the bounds given by its ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoundedCubic {
    cubic: Cubic,
    bounds: [f64; 2],
}

impl<V, I, S, A> GridLine<'_, V, I, S, A>
where
    V: Fn(usize) -> f64,
    I: Fn(usize) -> bool,
    S: Fn(usize) -> bool,
    A: Fn(usize) -> [f64; 2],
{
    /// Passes the segments on which the curve is positive to `tell`, by increasing coordinate.
    pub(crate) fn each_segment(&self, tell: impl FnMut(f64, f64)) {
        let mut segments = JoinedSegments { last: None, tell };
        for node in self.intervals.clone() {
            let [from, to] = (self.allowed)(node);
            if to <= from {
                continue;
            }
            let (low, high) = (self.axis[node], self.axis[node + 1]);
            // A whole interval must end exactly at its nodes, where segments join.
            let part = |s: f64, end: f64| {
                if s == 0.0 || s == 1.0 {
                    end
                } else {
                    low + s * (high - low)
                }
            };
            let (from, to) = (part(from, low), part(to, high));
            let mut tell = |left: f64, right: f64| segments.add(left.max(from), right.min(to));
            // Between two positive nodes the contact has no gap.
            if (self.inside)(node) && (self.inside)(node + 1) {
                tell(low, high);
                continue;
            }
            let values = [0, 1, 2, 3].map(|k| (self.value)(node + k - 1));
            let [_, here, next, _] = values;
            // Between two nodes that are not positive, a positive part counts only as the continuation of a smooth edge.
            if here > 0.0 || next > 0.0 || (self.smooth)(node) {
                self.positive_parts(node, values, tell);
            }
        }
        segments.end();
    }

    /// Passes the parts between a node and the next on which the curve is positive to `tell`; `values` are those of the nodes around.
    fn positive_parts(&self, node: usize, values: [f64; 4], mut tell: impl FnMut(f64, f64)) {
        let (low, high) = (self.axis[node], self.axis[node + 1]);
        let [_, here, next, _] = values;
        if here > 0.0 && next > 0.0 {
            tell(low, high);
            return;
        }
        let cubic = Cubic::between(self.axis, node, values);
        if cubic.is_never_positive() {
            return;
        }
        let mut start = (here > 0.0).then_some(low);
        for (at, positive) in cubic.sign_changes() {
            if positive {
                start = Some(at);
            } else if let Some(start) = start.take() {
                tell(start, at);
            }
        }
        if let Some(start) = start {
            tell(start, high);
        }
    }
}

/// Joins successive segments that meet.
struct JoinedSegments<T> {
    last: Option<(f64, f64)>,
    tell: T,
}

impl<T: FnMut(f64, f64)> JoinedSegments<T> {
    fn add(&mut self, left: f64, right: f64) {
        if left >= right {
            return;
        }
        match &mut self.last {
            Some(last) if last.1 == left => last.1 = right,
            last => {
                if let Some((from, to)) = last.replace((left, right)) {
                    (self.tell)(from, to);
                }
            }
        }
    }

    fn end(mut self) {
        if let Some((from, to)) = self.last {
            (self.tell)(from, to);
        }
    }
}

/// The curve between nodes `i` and `i + 1` of the axis; `values` belong to the nodes `i − 1` to `i + 2`.
pub(crate) fn cubic(axis: &[f64], i: usize, values: [f64; 4]) -> BoundedCubic {
    BoundedCubic {
        cubic: Cubic::between(axis, i, values),
        bounds: bounds(values[1], values[2], true),
    }
}

/// Bounds of the curve between two nodes.
///
/// Between positive nodes it stays above a quarter of the lower one. Between nodes that are neither positive nor smooth, it stays below a quarter of the higher one,
/// hence not positive. It does not exceed twice the largest sample, which is 1: between samples the pressure may be a few per cent larger, and a larger excess
/// results from very unequal spacing.
pub(crate) fn bounds(left: f64, right: f64, smooth: bool) -> [f64; 2] {
    const LARGEST: f64 = 2.0;
    let (lower, higher) = (left.min(right), left.max(right));
    let low = if lower > 0.0 {
        0.25 * lower
    } else {
        f64::NEG_INFINITY
    };
    let high = if higher > 0.0 || smooth {
        LARGEST
    } else {
        0.25 * higher
    };
    [low, high]
}

impl BoundedCubic {
    /// Value at x, never negative.
    pub(crate) fn at(&self, x: f64) -> f64 {
        self.cubic
            .at(x)
            .clamp(self.bounds[0], self.bounds[1])
            .max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_continued_exactly() {
        let axis: Vec<f64> = (0..24)
            .map(|k| -1.4 + 0.12 * f64::from(k) + 0.001 * f64::from(k * k))
            .collect();
        let grid = SampleGrid {
            x: axis.clone(),
            y: axis,
        };
        let exact = |k: usize| {
            let (x, y) = (grid.x[k % 24], grid.y[k / 24]);
            1.0 - x * x - 0.3 * x * y - 1.3 * y * y
        };
        let mut q: Vec<f64> = (0..24 * 24).map(|k| exact(k).max(0.0)).collect();
        let near = near_positive(&grid, &q);
        extend(&grid, &mut q);
        let worst = (0..24 * 24)
            .filter(|k| near[*k])
            .map(|k| (q[k] - exact(k)).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-11, "{worst}");
        assert!(near.iter().any(|near| !near) && q.iter().all(|q| *q <= 1.0));
    }

    #[test]
    fn the_edge_stays_between_inside_and_outside() {
        let edge_value = |at: f64, inside: &[(f64, f64)]| {
            edge_value(at, inside, interpolation::polynomial_value(inside, at))
        };
        let last = 0.5;
        for next in [0.0, 0.2, 0.5, 0.6, 1.0, 5.0] {
            let (value, _) = edge_value(2.0, &[(1.0, last), (0.0, next)]);
            assert!(value <= 0.0, "{next}: {value}");
        }
        assert_eq!(edge_value(2.0, &[(1.0, last)]), (-last, State::Step));
        let flat = [(1.0, last), (0.0, last), (-1.0, last)];
        assert_eq!(edge_value(2.0, &flat), (-last, State::Step));
        // A parabola that reaches 0 just at the sample keeps its edge there in spite of rounding.
        let hertz = [(1.0, 3.0), (0.0, 4.0), (-1.0, 3.0 + 1e-15)];
        assert_eq!(edge_value(2.0, &hertz), (0.0, State::Rough));
    }
}
