//! The place where something positive that falls about linearly to 0 ends.

/// Evaluations after which the bracket is no longer narrowed. Numeric safety: halvings alone narrow it to rounding in 55.
const EVALUATIONS_MAX: usize = 60;
/// Width of the bracket at the end relative to the one at the beginning: mirror images stay alike to 1e-9, and 1e-9 here was not enough for that.
const CLOSE: f64 = 1e-11;
/// How far from the first place expected a value is asked for, relative to its distance. It changes how many values are asked for, as the next
/// three do: together 15 for an end that is about a parabola.
const ASIDE: f64 = 0.03;
/// The same for later places, relative to how far they moved.
const ASIDE_MOVED: f64 = 0.05;
/// Where there is no value a little before the place expected, the next try is this many times farther from it.
const FARTHER: f64 = 16.0;
/// After so many steps that hardly narrow the bracket it is halved.
const SLOW_STEPS: usize = 3;

/// The last place on the way from `inside` to `outside` where there is a value; `value` has one inside, nothing beyond the end.
///
/// Two values tell where a straight line through them ends; the bracket is closed by places a little before and a little beyond that.
pub(crate) fn end([outside, inside]: [f64; 2], value: impl Fn(f64) -> Option<f64>) -> f64 {
    let toward = (outside - inside).signum();
    let close = CLOSE * (outside - inside).abs();
    let (mut outer, mut inner) = (outside, (inside, value(inside).unwrap_or(0.0)));
    let mut expected: Option<f64> = None;
    let (mut aside, mut beyond, mut slow) = (0.0_f64, false, 0);
    for _ in 0..EVALUATIONS_MAX {
        let (at, left) = inner;
        let width = (outer - at).abs();
        if width <= close {
            break;
        }
        let (low, high) = (at.min(outer), at.max(outer));
        let by = toward * if beyond { aside } else { -aside };
        let next = expected
            .map(|expected| expected + by)
            .filter(|next| *next > low && *next < high && slow < SLOW_STEPS);
        let next = next.unwrap_or(0.5 * (low + high));
        match value(next) {
            Some(found) => {
                let end = next + found * (next - at) / (left - found);
                aside = match expected {
                    Some(last) => ASIDE_MOVED * (end - last).abs(),
                    None => ASIDE * (end - next).abs(),
                };
                aside = aside.max(0.25 * close);
                (inner, expected, beyond) = ((next, found), Some(end), !beyond);
            }
            None => {
                outer = next;
                aside *= if beyond { 1.0 } else { FARTHER };
                beyond = false;
            }
        }
        let halved = (outer - inner.0).abs() <= 0.5 * width;
        slow = if halved { 0 } else { slow % SLOW_STEPS + 1 };
    }
    inner.0
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// The end that is found of a value, from either side, and the evaluations that it takes.
    fn found(value: impl Fn(f64) -> f64) -> [(f64, usize); 2] {
        [[2.0, 0.0], [-2.0, 0.0]].map(|bracket| {
            let count = Cell::new(0);
            let side = f64::signum(bracket[0]);
            let end = end(bracket, |at| {
                count.set(count.get() + 1);
                Some(value(side * at)).filter(|value| *value > 0.0)
            });
            (side * end, count.get())
        })
    }

    #[test]
    fn the_end_is_found_to_rounding_in_fewer_steps_than_halvings_take() {
        let values: [fn(f64) -> f64; 4] = [
            |x| 1.3 - x,
            |x| (1.3 * 1.3 - x * x) * (1.0 + 0.2 * x),
            |x| (1.3 - x) * (2.0 + (3.0 * x).sin()),
            // Two slopes: the place expected is wrong before the corner.
            |x| (1.3 - x).min(0.2 * (1.4 - x) + 0.06),
        ];
        for (k, value) in values.into_iter().enumerate() {
            for (end, count) in found(value) {
                assert!((end - 1.3).abs() < 1e-10 && end <= 1.3, "{k}: {end}");
                assert!(count <= 25, "{k}: {count}");
            }
        }
    }

    #[test]
    fn ends_that_are_steps_or_touch_are_found_by_halves() {
        let values: [fn(f64) -> f64; 2] = [
            |x| if x < 1.3 { 1.0 } else { 0.0 },
            |x| (1.3 - x).max(0.0).powi(4),
        ];
        for (k, value) in values.into_iter().enumerate() {
            for (end, count) in found(value) {
                assert!((end - 1.3).abs() < 1e-3 && end <= 1.3, "{k}: {end}");
                assert!(count <= EVALUATIONS_MAX + 1, "{k}: {count}");
            }
        }
    }
}
