//! Vertical equilibrium of a wheel on planes: fixed-point iterations with secant steps between normal and tangential forces.

use crate::contact::error::SolveError;
use crate::contact::normal::wheel_height::wheel_contact::WheelContact;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::resolution::Resolution;

/// When the rounds are used up, a share that still changes by no more than this is answered with a remark. Chosen by judgement; how much it matters
/// was not measured.
const BALANCE_POOR: f64 = 5e-3;
/// Range of the slope of the friction found over the friction assumed that a secant step uses. Numeric safety, not tuned.
const SLOPES: [f64; 2] = [-0.9, 0.6];
/// The vertical force may be missed by this fraction; it bounds the change of friction's share in one round. Chosen by judgement; how much it
/// matters was not measured.
pub(crate) const BALANCE: f64 = 5e-4;
/// Upper limit of that fraction, relative to the target error. Chosen by judgement; how much it matters was not measured.
const BALANCE_OF_TARGET: f64 = 0.1;
/// Rounds of the balance; each leaves about a tenth of the difference before, on steep flanges a third, less by the secant.
pub(crate) const ROUNDS_MAX: u32 = 12;

/// How the iterations end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum EquilibriumExit {
    /// Friction's share is what it was taken for.
    Balanced,
    /// In the last round the vertical force changed by this part.
    RoundsUsedUp { change: f64 },
    /// Friction takes nearly all that the normal forces carry.
    NothingCarried,
}

impl EquilibriumExit {
    /// The answers of the last round, if they are good enough: with a remark where they are not quite.
    ///
    /// # Errors
    /// The forces do not come to balance.
    pub(crate) fn judged<A>(
        self,
        last: Option<A>,
        tolerance: f64,
        share: f64,
        wheel: &mut WheelContact,
    ) -> Result<A, SolveError> {
        match (self, last) {
            (EquilibriumExit::Balanced, Some(answers)) => Ok(answers),
            (EquilibriumExit::RoundsUsedUp { change }, Some(answers)) if change <= BALANCE_POOR => {
                let remark = Remark::IterationInexact {
                    iteration: "balance of friction and the vertical force",
                    reason: "the rounds were used up",
                    residual: change,
                    tolerance,
                };
                wheel.remarks.push(remark.into());
                Ok(answers)
            }
            _ => Err(SolveError::NormalProblem {
                reason: format!(
                    "normal and tangential forces do not come to balance the vertical force in {ROUNDS_MAX} rounds; \
                     friction carries {share:+.3} of what the normal forces do. Give a normal_force_n or an approach_mm"
                ),
            }),
        }
    }
}

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
