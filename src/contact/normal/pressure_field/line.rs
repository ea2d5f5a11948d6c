//! Squared pressure along a straight grid-parallel line: where it is positive.

use crate::contact::numerics::roots::Cubic;

/// Values at the nodes of an axis, and the intervals that may belong to a patch. Everything is asked for when it is needed: most
/// intervals of a line lie inside the contact, where no values are.
pub(crate) struct GridLine<'f, V, I, S, A> {
    pub(crate) axis: &'f [f64],
    /// The intervals, each named by the node at its start. Values are asked for one node before and one after them as well.
    pub(crate) intervals: std::ops::RangeInclusive<usize>,
    /// Nodes between which all are surely positive and every interval belongs to the patch, if that is known.
    pub(crate) whole: Option<[usize; 2]>,
    /// The value at a node.
    pub(crate) value: V,
    /// Is the value at a node surely positive?
    pub(crate) inside: I,
    /// Are the samples around an interval smooth?
    pub(crate) smooth: S,
    /// Which part of an interval may belong to the patch, from 0 at its start to 1 at its end; nothing if the part is empty.
    pub(crate) allowed: A,
}

/// A cubic kept within the bounds that its ends suggest.
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
    /// Tells the segments where the curve is positive, from smaller to larger coordinate.
    pub(crate) fn each_segment(&self, tell: impl FnMut(f64, f64)) {
        let mut segments = JoinedSegments { last: None, tell };
        let mut known: Option<(usize, [f64; 4])> = None;
        let mut nodes = self.intervals.clone();
        while let Some(node) = nodes.next() {
            if let Some([first, last]) = self.whole.filter(|[first, _]| *first == node) {
                segments.add(self.axis[first], self.axis[last]);
                nodes = last..=*self.intervals.end();
                continue;
            }
            let [from, to] = (self.allowed)(node);
            if to <= from {
                continue;
            }
            let (low, high) = (self.axis[node], self.axis[node + 1]);
            // The ends of a whole interval are its nodes to the last digit, so that segments join there.
            let part = |s: f64, end: f64| {
                if s == 0.0 || s == 1.0 {
                    end
                } else {
                    low + s * (high - low)
                }
            };
            let (from, to) = (part(from, low), part(to, high));
            let mut tell = |left: f64, right: f64| segments.add(left.max(from), right.min(to));
            // Between two positive nodes the contact is whole: a gap there is not in the data.
            if (self.inside)(node) && (self.inside)(node + 1) {
                tell(low, high);
                continue;
            }
            let values = match known {
                Some((before, [_, a, b, c])) if before + 1 == node => {
                    [a, b, c, (self.value)(node + 2)]
                }
                _ => [0, 1, 2, 3].map(|k| (self.value)(node + k - 1)),
            };
            known = Some((node, values));
            let [_, here, next, _] = values;
            // Between two nodes that are not positive, a positive part counts only where it continues a smooth edge.
            if here > 0.0 || next > 0.0 || (self.smooth)(node) {
                self.positive_parts(node, values, tell);
            }
        }
        segments.end();
    }

    /// Tells where the curve is positive between a node and the next one, part by part; `values` are those of the nodes around.
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

/// Segments told one after the other, those that meet as one.
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

/// Least and largest value of the curve between two nodes.
///
/// If both are positive it stays above a quarter of the lower one; if none is and they are not smooth, below a quarter
/// of the higher one, so not positive. It never exceeds twice the largest sample, which is 1: between samples the pressure
/// may be a few per cent larger than on them; a larger excess results from very unequal spacing.
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
