//! Vertical equilibrium of a wheel: fixed-point iterations with secant steps between normal and tangential forces.

use crate::contact::rolling::task::Resolution;

/// Range of the slope of the friction found over the friction assumed that a secant step uses. Numeric safety, not tuned.
const SLOPES: [f64; 2] = [-0.9, 0.6];
/// The vertical force may be missed by this fraction; it bounds the change of friction's share in one round. Half of it makes a third of the rows of a pair
/// at a target of 0.02 solve their tractions twice.
const BALANCE: f64 = 1e-3;
/// Upper limit of that fraction, relative to the target error. Chosen by judgement; how much it matters was not measured.
const BALANCE_OF_TARGET: f64 = 0.1;

/// The friction to count on next, after rounds that counted on the first of two numbers and found the second: a secant step
/// where two rounds tell the slope, because friction found may swing about friction counted on where a flange is steep.
pub(crate) fn next_share((counted, found): (f64, f64), before: Option<(f64, f64)>) -> f64 {
    let slope = match before {
        Some((at, was)) if (counted - at).abs() > f64::EPSILON => (found - was) / (counted - at),
        _ => 0.0,
    };
    counted + (found - counted) / (1.0 - slope.clamp(SLOPES[0], SLOPES[1]))
}

/// By which part the vertical force may be missed.
pub(crate) fn tolerance(resolution: Resolution) -> f64 {
    match resolution {
        Resolution::Target(target) => BALANCE.min(BALANCE_OF_TARGET * target),
        Resolution::Mesh(_) => BALANCE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_round_hits_the_balance_of_a_straight_line_however_it_swings() {
        for slope in [-0.8, -0.3, 0.2, 0.5] {
            let found = |counted: f64| 0.1 + slope * counted;
            let first = (0.3, found(0.3));
            let counted = next_share(first, None);
            assert!(
                (counted - first.1).abs() < 1e-12,
                "nothing is known of the slope yet"
            );
            let balanced = next_share((counted, found(counted)), Some(first));
            assert!((found(balanced) - balanced).abs() < 1e-12, "{slope}");
        }
    }

    #[test]
    fn a_slope_beyond_belief_makes_no_wild_step() {
        let step = next_share((0.2, 0.3), Some((0.2 - 1e-6, 0.1))) - 0.2;
        assert!((step - 0.25).abs() < 1e-9, "{step}");
    }
}
