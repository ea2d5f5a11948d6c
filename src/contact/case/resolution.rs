//! The resolution a case asks for.

use crate::contact::case::words::solver::{MethodName, Solver};
use crate::contact::rolling::methods::fastsim;
use crate::contact::rolling::resolution::Resolution;

/// Allowed error of the resultants when nothing else is asked for, relative to μN.
pub(crate) const TARGET_ERROR_DEFAULT: f64 = 0.005;

pub(crate) fn resolution(solver: &Solver) -> Resolution {
    match (solver.mesh, solver.target_error) {
        (Some(size), _) => Resolution::Mesh(size.into()),
        // As it would solve for any target.
        (None, None) if solver.method == MethodName::Fastsim => Resolution::Mesh(fastsim::MESH),
        (None, target) => Resolution::Target(target.unwrap_or(TARGET_ERROR_DEFAULT)),
    }
}
