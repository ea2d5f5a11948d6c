//! The root of a monotone function in a bracket: Newton's method, with bisection where a step fails, so that it always converges.

use std::convert::Infallible;

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
    bracket: [f64; 2],
    start: f64,
    course: Course,
    close: CloseEnough,
    f: impl Fn(f64) -> [f64; 2],
) -> f64 {
    let Ok(root) = try_find(bracket, start, course, close, |at| {
        Ok::<[f64; 2], Infallible>(f(at))
    });
    root
}

/// The same for a function that may have no value, which ends the search. Ends of the bracket may be infinite as long as Newton steps
/// stay finite. Where the criterion for the value is met, the root returned is the argument evaluated last.
///
/// # Errors
/// The one of `f`.
pub(crate) fn try_find<E>(
    [mut low, mut high]: [f64; 2],
    start: f64,
    course: Course,
    close: CloseEnough,
    mut f: impl FnMut(f64) -> Result<[f64; 2], E>,
) -> Result<f64, E> {
    let inside = |at: f64, low: f64, high: f64| at > low && at < high;
    let mut at = if (low..=high).contains(&start) {
        start
    } else {
        0.5 * (low + high)
    };
    for step in 1..=2 * NEWTON_STEPS {
        let [value, slope] = f(at)?;
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
    Ok(at)
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

    #[test]
    fn a_root_without_known_bounds_is_found_and_a_missing_value_ends_the_search() {
        let close = CloseEnough {
            value: 1e-9,
            place: 0.0,
        };
        let open = [f64::NEG_INFINITY, f64::INFINITY];
        let mut last = f64::NAN;
        // A kink at 2: the slope there is that of one side.
        let kinked = |x: f64| {
            last = x;
            let slope = if x < 2.0 { -1.0 } else { -0.2 };
            Ok::<_, ()>([slope * (x - 2.0) - 0.5, slope])
        };
        let root = try_find(open, 7.0, Course::Falling, close, kinked).unwrap();
        assert!((root - 1.5).abs() < 1e-8, "{root}");
        assert_eq!(root, last);
        let missing = |x: f64| if x > 1.0 { Err(x) } else { Ok([x - 1.5, 1.0]) };
        let ended = try_find(open, 0.0, Course::Rising, close, missing);
        assert_eq!(ended, Err(1.5));
    }
}
