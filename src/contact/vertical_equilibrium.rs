//! Vertical equilibrium of a wheel: fixed-point iterations with secant steps between normal and tangential forces.

use crate::rolling::task::{NEGLIGIBLE_OF_TARGET, Resolution};

/// Range of the slope of the friction found over the friction assumed that a secant step uses. Numeric safety, not tuned.
const SLOPES: [f64; 2] = [-0.9, 0.6];
/// The vertical force may be missed by this fraction; it bounds the change of friction's share in one round. Half of it makes a third of the rows of a pair
/// at a target of 0.02 solve their tractions twice.
const BALANCE: f64 = 1e-3;

/// The friction to count on in the next round, after a round that counted on some numbers and found others, `[counted, found]`.
///
/// Where the round before gives a slope, it is a secant step with one slope for all numbers: on a steep flange, the friction found may swing about the friction
/// counted on. A round before on another grid, which has more or fewer numbers, is ignored.
pub(crate) fn next_share(
    [counted, found]: [Vec<f64>; 2],
    before: Option<[Vec<f64>; 2]>,
) -> Vec<f64> {
    let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let slope = match before {
        Some([at, was]) if at.len() == counted.len() && was.len() == found.len() => {
            let (step, change) = (less(&counted, &at), less(&found, &was));
            product(&step, &change) / product(&step, &step).max(f64::MIN_POSITIVE)
        }
        _ => 0.0,
    };
    let factor = 1.0 / (1.0 - slope.clamp(SLOPES[0], SLOPES[1]));
    let steps = less(&found, &counted);
    counted
        .iter()
        .zip(steps)
        .map(|(counted, step)| counted + factor * step)
        .collect()
}

/// By which part the vertical force may be missed.
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
            let found = |counted: f64| 0.1 + slope * counted;
            let first = [vec![0.3, 0.0], vec![found(0.3), 0.0]];
            let counted = next_share(first.clone(), None);
            assert!(
                (counted[0] - first[1][0]).abs() < 1e-12,
                "nothing is known of the slope yet"
            );
            let second = vec![found(counted[0]), 0.0];
            let balanced = next_share([counted, second], Some(first))[0];
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
