//! Compares an answer with the reference result.

use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::answer::Resultants;
use railhead_contact::solution::words::answer::{Fields, Solution};

use crate::patches::{self, PatchAnswer, left_open};
use crate::population::Class;
use crate::truth::{Judged, Truth};

/// Returns pairs of estimated and true error of an answer: one for the sum, or one for each patch of a wheel on a rail. The estimates of patches
/// exclude the part for the factors for the curvature, which mesh refinement does not show. Returns `None` without an estimate.
pub fn judged(
    class: Class,
    truth: &Truth,
    case: &CheckedCase,
    (solution, fields): &(Solution, Fields),
) -> Option<Vec<Judged>> {
    if class.is_wheel() {
        let open = match class {
            Class::Curve => left_open(case, solution, fields),
            _ => 0.0,
        };
        return PatchAnswer::of_solution(solution, open)
            .map(|found| patches::judged(truth, &found));
    }
    let total = &solution.total[0];
    let sum = Resultants {
        force_x: total.force_x_n,
        force_y: total.force_y_n,
        moment_z: total.moment_z_n_mm,
    };
    let estimate = total.error_estimate?.force_x_n;
    Some(vec![truth.whole.judged(sum, estimate)])
}
