//! The tractions of a wheel on a rail about, by the table of creep forces, so that the height of the wheel is sought with them.

use crate::normal::footprint::LoadAcross;
use crate::normal::wheel::WheelPatch;
use crate::problem::physics::Problem;
use crate::rolling::load_ellipse::LoadEllipse;
use crate::rolling::methods::table::solve::{forces, tells};
use crate::rolling::task::Motion;

/// Can the tractions be estimated for this problem? The table must know its physics, and creepages be given.
pub(crate) fn can_estimate(problem: &Problem) -> bool {
    tells(&problem.elasticity, problem.interface, &problem.friction)
        && problem.forces.iter().all(|forces| *forces == [None; 2])
}

/// Forces of friction on the rail in N along x and across in a motion about the load centre of a patch, which is taken for the ellipse that carries its load
/// the same way.
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
