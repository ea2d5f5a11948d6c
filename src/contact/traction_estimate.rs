//! Estimate of the tractions of a wheel on a rail from the table of creep forces, for the search for the height of the wheel.

use crate::normal::footprint::LoadAcross;
use crate::normal::wheel::WheelPatch;
use crate::problem::physics::Problem;
use crate::rolling::load_ellipse::LoadEllipse;
use crate::rolling::methods::table::solve::{forces, tells};
use crate::rolling::task::Motion;

/// Whether the tractions of a problem can be estimated: the table must cover its physics, and creepages must be given.
pub(crate) fn can_estimate(problem: &Problem) -> bool {
    tells(&problem.elasticity, problem.interface, &problem.friction)
        && problem.forces.iter().all(|forces| *forces == [None; 2])
}

/// Forces of friction on the rail in N along x and across, for a motion about the load centre of a patch. The patch is replaced by its equivalent ellipse.
pub(crate) fn patch_forces(problem: &Problem, patch: &WheelPatch, motion: &Motion) -> [f64; 2] {
    let ellipse = LoadEllipse::of_samples(&patch.field, patch.number);
    let modulus = problem.interface.reduction * problem.elasticity.shear_modulus;
    let across = || LoadAcross::of_samples(&patch.field, patch.number);
    let limit = problem.friction.limit_under(patch.normal_force(), across);
    forces(
        modulus,
        problem.elasticity.poisson_ratio,
        &ellipse,
        limit,
        motion,
    )
}
