//! Vertical equilibrium of a wheel: fixed-point iteration with secant steps between normal and tangential forces.

use crate::rolling::task::{NEGLIGIBLE_OF_TARGET, Resolution};

/// Range to which the slope of a secant step is limited. Not tuned.
const SLOPES: [f64; 2] = [-0.9, 0.6];
/// Relative tolerance of the vertical force. With half of it, a third of the rows of a pair at a target of 0.02 solve their tractions twice.
const BALANCE: f64 = 1e-3;

/// The friction to assume in the next round, after a round with some assumed values found others: `[assumed, found]`.
///
/// With the values of the round before, it is a secant step with one slope for all values. On a steep flange, the friction found may otherwise
/// oscillate about the friction assumed. A round before on another grid, with another number of values, is ignored.
pub(crate) fn next_share(
    [assumed, found]: [Vec<f64>; 2],
    before: Option<[Vec<f64>; 2]>,
) -> Vec<f64> {
    let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let slope = match before {
        Some([at, was]) if at.len() == assumed.len() && was.len() == found.len() => {
            let (step, change) = (less(&assumed, &at), less(&found, &was));
            product(&step, &change) / product(&step, &step).max(f64::MIN_POSITIVE)
        }
        _ => 0.0,
    };
    let factor = 1.0 / (1.0 - slope.clamp(SLOPES[0], SLOPES[1]));
    let steps = less(&found, &assumed);
    assumed
        .iter()
        .zip(steps)
        .map(|(assumed, step)| assumed + factor * step)
        .collect()
}

/// Relative tolerance of the vertical force.
pub(crate) fn tolerance(resolution: Resolution) -> f64 {
    match resolution {
        Resolution::Target(target) => BALANCE.min(NEGLIGIBLE_OF_TARGET * target),
        Resolution::Mesh(_) => BALANCE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_round_hits_the_balance_of_a_straight_line_however_it_swings() {
        for slope in [-0.8, -0.3, 0.2, 0.5] {
            let found = |assumed: f64| 0.1 + slope * assumed;
            let first = [vec![0.3, 0.0], vec![found(0.3), 0.0]];
            let assumed = next_share(first.clone(), None);
            assert!(
                (assumed[0] - first[1][0]).abs() < 1e-12,
                "the first step has no slope"
            );
            let second = vec![found(assumed[0]), 0.0];
            let balanced = next_share([assumed, second], Some(first))[0];
            assert!((found(balanced) - balanced).abs() < 1e-12, "{slope}");
        }
    }

    #[test]
    fn a_slope_beyond_belief_makes_no_wild_step() {
        let before = [vec![0.2 - 1e-6], vec![0.1]];
        let step = next_share([vec![0.2], vec![0.3]], Some(before))[0] - 0.2;
        assert!((step - 0.25).abs() < 1e-9, "{step}");
    }
}
