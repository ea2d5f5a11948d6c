//! The boundary of a condition, the maximum in an interval, and the root of a monotone function in a bracket by Newton's method with bisection; and cubics through
//! samples with unequal spacing, with their roots; and the range of some values.
//!
//! The tangents of a cubic at its nodes are those of the parabola through the node and its two neighbours, so the curve has a continuous derivative and reproduces
//! parabolas exactly (Catmull and Rom 1974, for unequal spacing).

use crate::numerics::ITERATIONS_MAX;

/// Relative differences below this are rounding errors of values after many operations.
pub(crate) const ROUNDING: f64 = 1e-9;

/// The least and the largest of some values; `[∞, −∞]` if there are none.
pub(crate) fn bounds(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let widened = |[least, largest]: [f64; 2], value: f64| [least.min(value), largest.max(value)];
    values.into_iter().fold(none, widened)
}

/// Bisects the interval between `low` and `high` (in either order) and returns the bracket after the given number of halvings. `is_low` is true on the side of `low` and
/// false on that of `high`.
pub(crate) fn bisect(
    [mut low, mut high]: [f64; 2],
    halvings: u32,
    is_low: impl Fn(f64) -> bool,
) -> [f64; 2] {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_low(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    [low, high]
}

/// Maximum of a unimodal function in an interval, by parabolic interpolation and golden sections (Brent 1973). The argument is accurate to 1e-4 of the interval, so the
/// relative error of a smooth maximum is about the square of this. For a function with several maxima, the result is one of them. Takes at most forty evaluations.
pub(crate) fn maximum([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const SHORT: f64 = 0.381_966_011_250_105_1;
    let close = 1e-4 * (high - low);
    let best = low + SHORT * (high - low);
    // The best argument, the second best and the previous second best, each with its value.
    let mut places = [(best, f(best)); 3];
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    for _ in 0..ITERATIONS_MAX {
        let [(x, fx), (w, fw), (v, fv)] = places;
        let middle = 0.5 * (low + high);
        if (x - middle).abs() <= 2.0 * close - 0.5 * (high - low) {
            break;
        }
        let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
        let parabola = ((x - w) * r - (x - v) * q) / (2.0 * (q - r));
        let inside = parabola > low - x && parabola < high - x;
        if inside && parabola.abs() < 0.5 * before.abs() {
            (before, step) = (step, parabola);
        } else {
            before = if x < middle { high - x } else { low - x };
            step = SHORT * before;
        }
        let at = x + step.abs().max(close).copysign(step);
        let value = f(at);
        if value >= fx {
            *(if at >= x { &mut low } else { &mut high }) = x;
            places = [(at, value), (x, fx), (w, fw)];
            continue;
        }
        *(if at < x { &mut low } else { &mut high }) = at;
        if value >= fw || w == x {
            places = [(x, fx), (at, value), (w, fw)];
        } else if value >= fv || v == x || v == w {
            places[2] = (at, value);
        }
    }
    places[0].1
}

/// Number of halvings that reduce a bracket to rounding error, and of evaluations after which a search halves instead of taking Newton steps.
pub(crate) const HALVINGS: u32 = 60;

/// Criteria for the end of a search: it ends when the value, the last step or the bracket is smaller; 0 disables a criterion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CloseEnough {
    /// Magnitude of the value.
    pub(crate) value: f64,
    /// Length of the last step, or of the bracket.
    pub(crate) place: f64,
}

/// Whether a function rises or falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Course {
    Rising,
    Falling,
}

/// The root of a function that rises or falls from `low` to `high`. `f` returns value and slope. The search starts at `start`, or in the middle of the bracket if `start`
/// lies outside. If Newton steps do not converge, as at a triple root, sixty halvings reduce the bracket to rounding error.
pub(crate) fn find(
    [mut low, mut high]: [f64; 2],
    start: f64,
    course: Course,
    close: CloseEnough,
    f: impl Fn(f64) -> [f64; 2],
) -> f64 {
    let inside = |at: f64, low: f64, high: f64| at > low && at < high;
    let mut at = if (low..=high).contains(&start) {
        start
    } else {
        0.5 * (low + high)
    };
    for step in 1..=2 * HALVINGS {
        let [value, slope] = f(at);
        if value.abs() < close.value {
            break;
        }
        if (value > 0.0) == (course == Course::Rising) {
            high = at;
        } else {
            low = at;
        }
        let newton = at - value / slope;
        let next = if inside(newton, low, high) && step < HALVINGS {
            newton
        } else {
            0.5 * (low + high)
        };
        let moved = (next - at).abs();
        at = next;
        if moved < close.place || high - low < close.place {
            break;
        }
    }
    at
}

/// A cubic `c0 + c1 s + c2 s² + c3 s³` on an interval, with s from 0 at its start to 1 at its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cubic {
    start: f64,
    length: f64,
    coefficients: [f64; 4],
    /// The value at s = 1. It is stored because the sum of the coefficients differs from it by rounding, and neighbouring
    /// intervals have to agree on its sign.
    end: f64,
}

impl Cubic {
    /// The curve between nodes `i` and `i + 1` of the axis; `values` belong to the nodes `i − 1` to `i + 2`, which must exist.
    pub(crate) fn between(axis: &[f64], i: usize, values: [f64; 4]) -> Cubic {
        let [before, length, after] = [
            axis[i] - axis[i - 1],
            axis[i + 1] - axis[i],
            axis[i + 2] - axis[i + 1],
        ];
        let [v0, v1, v2, v3] = values;
        let rise = v2 - v1;
        let tangent_start = length * tangent(before, length, v1 - v0, rise);
        let tangent_end = length * tangent(length, after, rise, v3 - v2);
        Cubic {
            start: axis[i],
            length,
            coefficients: [
                v1,
                tangent_start,
                3.0 * rise - 2.0 * tangent_start - tangent_end,
                tangent_start + tangent_end - 2.0 * rise,
            ],
            end: v2,
        }
    }

    /// The curve between nodes `i` and `i + 1` of the axis with the given values and slopes at them.
    #[cfg(test)]
    pub(crate) fn with_slopes(axis: &[f64], i: usize, values: [f64; 2], slopes: [f64; 2]) -> Cubic {
        let length = axis[i + 1] - axis[i];
        let rise = values[1] - values[0];
        let [start, end] = slopes.map(|slope| length * slope);
        Cubic {
            start: axis[i],
            length,
            coefficients: [
                values[0],
                start,
                3.0 * rise - 2.0 * start - end,
                start + end - 2.0 * rise,
            ],
            end: values[1],
        }
    }

    /// Value at x.
    pub(crate) fn at(&self, x: f64) -> f64 {
        self.value((x - self.start) / self.length)
    }

    /// Whether the curve is certainly positive nowhere. Its values are means, with non-negative weights, of those at both ends and of two given by the tangents there.
    pub(crate) fn is_never_positive(&self) -> bool {
        let [c0, c1, c2, c3] = self.coefficients;
        let before_end = self.end - (c1 + 2.0 * c2 + 3.0 * c3) / 3.0;
        c0 <= 0.0 && self.end <= 0.0 && c0 + c1 / 3.0 <= 0.0 && before_end <= 0.0
    }

    /// The points where the sign changes from or to positive, by increasing x, each with the sign after it (`true` is positive). They are accurate to a few units in the
    /// last place, or to 1e-8 of the interval where two of them nearly meet.
    pub(crate) fn sign_changes(&self) -> impl Iterator<Item = (f64, bool)> + use<> {
        let cubic = *self;
        let [first, second] = self.turning_points();
        let pieces = [(0.0, first), (first, second), (second, 1.0)];
        pieces.into_iter().filter_map(move |(low, high)| {
            let (at_low, at_high) = (cubic.value(low) > 0.0, cubic.value(high) > 0.0);
            (at_low != at_high)
                .then(|| (cubic.start + cubic.length * cubic.root(low, high), at_high))
        })
    }

    /// Value at a fraction of the interval, 0 at its start and 1 at its end.
    pub(crate) fn value(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.coefficients;
        if s == 1.0 {
            return self.end;
        }
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// The turning points that divide 0..=1 into monotone pieces, in order; those outside are replaced by the closer end.
    fn turning_points(&self) -> [f64; 2] {
        let [_, c1, c2, c3] = self.coefficients;
        // The slope is a mean of these with non-negative weights.
        let slopes = [c1, c1 + c2, c1 + 2.0 * c2 + 3.0 * c3];
        if slopes.iter().all(|slope| *slope >= 0.0) || slopes.iter().all(|slope| *slope <= 0.0) {
            return [0.0, 1.0];
        }
        let discriminant = c2 * c2 - 3.0 * c1 * c3;
        if discriminant <= 0.0 {
            return [0.0, 1.0];
        }
        // The stable form of the quadratic formula for 3 c3 s² + 2 c2 s + c1 = 0.
        let w = -(c2 + discriminant.sqrt().copysign(c2));
        let inside = |s: f64| if s > 0.0 && s < 1.0 { s } else { f64::NAN };
        let [first, second] = [inside(w / (3.0 * c3)), inside(c1 / w)];
        match (first.is_nan(), second.is_nan()) {
            (true, true) => [0.0, 1.0],
            (true, false) => [0.0, second],
            (false, true) => [first, 1.0],
            (false, false) => [first.min(second), first.max(second)],
        }
    }

    /// The root in a monotone piece with a change of sign.
    fn root(&self, low: f64, high: f64) -> f64 {
        let [_, c1, c2, c3] = self.coefficients;
        let [at_low, at_high] = [low, high].map(|s| self.value(s));
        let course = if at_high > 0.0 {
            Course::Rising
        } else {
            Course::Falling
        };
        let close = CloseEnough {
            value: 0.0,
            // A Newton step leaves an error of about its square.
            place: ROUNDING,
        };
        let secant = low + (high - low) * at_low / (at_low - at_high);
        find([low, high], secant, course, close, |at| {
            let slope = c1 + at * (2.0 * c2 + 3.0 * at * c3);
            [self.value(at), slope]
        })
    }
}

/// Weights of the nodes `i − 1` to `i + 2` in the value of the curve at x between nodes `i` and `i + 1`.
pub(crate) fn weights(axis: &[f64], i: usize, x: f64) -> [f64; 4] {
    let [before, length, after] = [
        axis[i] - axis[i - 1],
        axis[i + 1] - axis[i],
        axis[i + 2] - axis[i + 1],
    ];
    let s = (x - axis[i]) / length;
    // Hermite's functions of the rise and of the two tangents, which are means of the adjacent slopes.
    let rise = s * s * (3.0 - 2.0 * s);
    let start = s * (1.0 - s) * (1.0 - s) / (before + length);
    let end = s * s * (s - 1.0) / (length + after);
    let (outer_start, inner_start) = (start * length * length / before, start * before);
    let (outer_end, inner_end) = (end * length * length / after, end * after);
    [
        -outer_start,
        1.0 - rise + outer_start - inner_start - inner_end,
        rise + inner_start + inner_end - outer_end,
        outer_end,
    ]
}

/// The interval from node `i` to `i + 1` that contains x; the first or last one for points outside.
pub(crate) fn interval(axis: &[f64], x: f64) -> usize {
    axis.partition_point(|node| *node <= x)
        .clamp(1, axis.len() - 1)
        - 1
}

/// Slope at a node of the parabola through it and its neighbours at distances `before` and `after`, over which the value rises by `rise_before` and `rise_after`.
pub(crate) fn tangent(before: f64, after: f64, rise_before: f64, rise_after: f64) -> f64 {
    (rise_before * after * after + rise_after * before * before)
        / (before * after * (before + after))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_of_a_step_is_bracketed_from_either_side() {
        for bounds in [[0.0, 1.0], [1.0, 0.0]] {
            let rising = bounds[1] > bounds[0];
            let [low, high] = bisect(bounds, 30, |x| (x < 0.3) == rising);
            assert!((high - low).abs() <= 1e-9, "{low} {high}");
            assert!((low - 0.3).abs() <= 1e-9 && (high - 0.3).abs() <= 1e-9);
        }
    }

    #[test]
    fn the_top_of_a_hump_is_found_in_few_evaluations() {
        let humps: [(&dyn Fn(f64) -> f64, f64); 3] = [
            (&|x: f64| 1.0 - (x - 0.3).powi(2), 1.0),
            (&|x: f64| (x - 1.2).cos() * (1.0 + 1e-3 * x), 0.0),
            (&|x: f64| -(x - 0.77).abs(), 0.0),
        ];
        for (k, (hump, top)) in humps.into_iter().enumerate() {
            let evaluations = std::cell::Cell::new(0);
            let counted = |x: f64| {
                evaluations.set(evaluations.get() + 1);
                hump(x)
            };
            let found = maximum([-0.5, 2.0], counted);
            let exact = if k == 1 {
                (0..=250_000)
                    .map(|n| hump(-0.5 + 1e-5 * f64::from(n)))
                    .fold(f64::MIN, f64::max)
            } else {
                top
            };
            // At a kink the error of the value is proportional to that of the argument.
            let allowed = if k == 2 { 5e-4 } else { 1e-7 };
            assert!((found - exact).abs() < allowed, "{k}: {found} {exact}");
            assert!(
                evaluations.get() <= 25,
                "{k}: {} evaluations",
                evaluations.get()
            );
        }
    }
}

#[cfg(test)]
mod monotone_root_tests {
    use super::*;

    #[test]
    fn steep_flat_and_kinked_functions_have_their_root_found_to_the_last_digits() {
        let close = CloseEnough {
            value: 0.0,
            place: 4.0 * f64::EPSILON,
        };
        let functions: [fn(f64) -> [f64; 2]; 4] = [
            |x| [(x - 0.3).powi(3), 3.0 * (x - 0.3).powi(2)],
            |x| {
                [
                    (50.0 * (x - 0.3)).atan(),
                    50.0 / (1.0 + (50.0 * (x - 0.3)).powi(2)),
                ]
            },
            |x| {
                [
                    if x < 0.3 {
                        1e-3 * (x - 0.3)
                    } else {
                        1e3 * (x - 0.3)
                    },
                    1.0,
                ]
            },
            // A slope of 0 everywhere: no Newton step is possible.
            |x| [x - 0.3, 0.0],
        ];
        for (k, f) in functions.into_iter().enumerate() {
            for start in [-1.0, 0.0, 0.9] {
                let root = find([0.0, 1.0], start, Course::Rising, close, f);
                assert!((root - 0.3).abs() < 1e-15, "{k} {start}: {root}");
                let falling = |x: f64| f(x).map(|value| -value);
                let root = find([0.0, 1.0], start, Course::Falling, close, falling);
                assert!((root - 0.3).abs() < 1e-15, "{k} {start}, falling: {root}");
            }
        }
        let rough = CloseEnough {
            value: 1e-3,
            place: 0.0,
        };
        let root = find([0.0, 1.0], 0.5, Course::Rising, rough, |x| {
            [x * x - 0.09, 2.0 * x]
        });
        assert!((root * root - 0.09).abs() < 1e-3 && (root - 0.3).abs() > 1e-9);
    }
}

#[cfg(test)]
mod cubic_tests {
    use super::*;

    const AXIS: [f64; 6] = [-1.0, -0.7, 0.1, 0.25, 1.5, 1.6];

    fn parabola(x: f64) -> f64 {
        1.0 - 3.0 * x + 2.0 * x * x
    }

    fn cubic(i: usize, f: impl Fn(f64) -> f64) -> Cubic {
        Cubic::between(&AXIS, i, std::array::from_fn(|k| f(AXIS[i - 1 + k])))
    }

    #[test]
    fn parabolas_are_reproduced_on_unequal_spacing() {
        for i in 1..=3 {
            for x in [AXIS[i], 0.3 * AXIS[i] + 0.7 * AXIS[i + 1], AXIS[i + 1]] {
                assert!((cubic(i, parabola).at(x) - parabola(x)).abs() < 1e-14);
                let weights = weights(&AXIS, i, x);
                let sum: f64 = (0..4).map(|k| weights[k] * parabola(AXIS[i - 1 + k])).sum();
                assert!((sum - parabola(x)).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn both_roots_in_one_interval_are_found() {
        // 2 x² − 3 x + 1 has its roots at ½ and 1, between the nodes 0.25 and 1.5.
        let changes: Vec<(f64, bool)> = cubic(3, parabola).sign_changes().collect();
        assert_eq!(changes.len(), 2);
        assert!((changes[0].0 - 0.5).abs() < 1e-14 && !changes[0].1);
        assert!((changes[1].0 - 1.0).abs() < 1e-14 && changes[1].1);
        assert_eq!(cubic(1, parabola).sign_changes().count(), 0);
        assert_eq!(cubic(3, |x| x - 0.75).sign_changes().count(), 1);
        assert_eq!(cubic(3, |_| 0.0).sign_changes().count(), 0);
    }

    #[test]
    fn a_curve_said_to_be_positive_nowhere_is_not_and_turning_points_divide_every_curve() {
        let ends = [-1.0, -0.3, -0.01, 0.2];
        let steep = [-3.0, -0.4, 0.0, 0.02, 2.0];
        let mut never = 0;
        for (start, end) in ends.iter().flat_map(|a| ends.map(|b| (*a, b))) {
            for (leaving, arriving) in steep.iter().flat_map(|a| steep.map(|b| (*a, b))) {
                let cubic = Cubic::with_slopes(&[0.0, 1.0], 0, [start, end], [leaving, arriving]);
                let values: Vec<f64> = (0..=1000)
                    .map(|k| cubic.value(1e-3 * f64::from(k)))
                    .collect();
                if cubic.is_never_positive() {
                    never += 1;
                    assert!(values.iter().all(|value| *value <= 0.0), "{cubic:?}");
                }
                let [first, second] = cubic.turning_points();
                let place = |s: f64| (1e3 * s).round() as usize;
                for (from, to) in [
                    (0, place(first)),
                    (place(first), place(second)),
                    (place(second), 1000),
                ] {
                    let steps = || values[from..=to].windows(2).map(|pair| pair[1] - pair[0]);
                    // A turning point lies between two of the samples.
                    let against = |sign: f64| steps().filter(|step| sign * step < 0.0).count();
                    assert!(against(1.0).min(against(-1.0)) <= 2, "{cubic:?}");
                }
            }
        }
        assert!(never > 100, "{never}");
    }

    #[test]
    fn roots_are_exact_where_the_curve_is_flat_too() {
        for root in [0.25 + 1e-6, 0.3, 0.9, 1.5 - 1e-6] {
            let curve = |x: f64| (x - root).powi(3) + 1e-3 * (x - root);
            let slope = |x: f64| 3.0 * (x - root).powi(2) + 1e-3;
            let ends = [0.25, 1.5];
            let cubic = Cubic::with_slopes(&AXIS, 3, ends.map(curve), ends.map(slope));
            let changes: Vec<(f64, bool)> = cubic.sign_changes().collect();
            assert_eq!(changes.len(), 1, "{root}");
            assert!(
                (changes[0].0 - root).abs() < 1e-11 && changes[0].1,
                "{changes:?}"
            );
        }
    }

    #[test]
    fn a_triple_root_is_found_as_well_as_a_single_one() {
        for root in [0.3, 0.77, 1.2] {
            let curve = |x: f64| (x - root).powi(3);
            let slope = |x: f64| 3.0 * (x - root).powi(2);
            let ends = [0.25, 1.5];
            let cubic = Cubic::with_slopes(&AXIS, 3, ends.map(curve), ends.map(slope));
            let changes: Vec<(f64, bool)> = cubic.sign_changes().collect();
            // The value is rounded to 1e-17 there, and the error of a triple root is the cube root of that.
            assert!((changes[0].0 - root).abs() < 2e-5, "{root}: {changes:?}");
        }
    }

    #[test]
    fn intervals_hold_their_points() {
        assert_eq!(interval(&AXIS, -5.0), 0);
        assert_eq!(interval(&AXIS, -0.7), 1);
        assert_eq!(interval(&AXIS, 0.2), 2);
        assert_eq!(interval(&AXIS, 1.6), 4);
        assert_eq!(interval(&AXIS, 9.0), 4);
    }
}
