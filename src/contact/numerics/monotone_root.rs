//! The root of a monotone function in a bracket: Newton's method, with bisection where a step fails, so that it always converges.

/// Evaluations after which Newton steps are no longer tried and the bracket is halved every time.
const NEWTON_STEPS: usize = 60;

/// When a search ends: as soon as the value, the last step or the bracket is smaller than given here; 0 disables a criterion.
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

/// The root of a function that rises or falls from `low` to `high`. `f` returns value and slope. `start` is tried first, or the middle
/// of the bracket if `start` lies outside. If Newton steps do not converge, as at a triple root, sixty halvings reduce the bracket to
/// rounding error.
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
    for step in 1..=2 * NEWTON_STEPS {
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
        let next = if inside(newton, low, high) && step < NEWTON_STEPS {
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

#[cfg(test)]
mod tests {
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
