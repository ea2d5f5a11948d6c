//! The answer on a companion of a mesh.

use crate::contact::rolling::refinement::constants::{MARGIN, MARGIN_COMPARED, MARGIN_REFUSED};
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// What is known from a companion.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum CompanionAnswer {
    /// It was not solved.
    #[default]
    Untried,
    /// There is none: the mesh is too small to be halved, or the iteration did not converge.
    Missing,
    /// Resultants of every patch on the companion, and by how much their change from the mesh would be larger on exactly half the
    /// strips or cells if errors are of second order.
    Found(Vec<Resultants>, f64),
}

/// By how much the error of a mesh that is not good enough is multiplied to tell how many cells the next one has: errors fall as 1 over them.
pub(super) fn margin(task: &RollingTask, companions: &[CompanionAnswer]) -> f64 {
    let untried = |companion: &CompanionAnswer| matches!(companion, CompanionAnswer::Untried);
    match companions.iter().any(untried) {
        // Where tractions change the pressure, motions of a list and the same ones alone would differ by 0.6 % in pressure otherwise.
        _ if task.footprint.is_closed_form() || task.is_coupled() => MARGIN,
        // What refused it is a lower bound.
        true => MARGIN_REFUSED,
        false => MARGIN_COMPARED,
    }
}
