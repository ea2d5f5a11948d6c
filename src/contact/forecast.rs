//! The part of a vertical force that friction will carry, forecast with the table of creep forces, so that the height of a wheel is sought with it.

use crate::contact::error::SolveError;
use crate::contact::friction::on_rail::in_frame;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::geometry::wheelset::{WheelsetMotion, creepages};
use crate::contact::normal::load_across::LoadAcross;
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};
use crate::contact::problem::physics::Problem;
use crate::contact::rolling::load_ellipse::LoadEllipse;
use crate::contact::rolling::methods::table::solve::{forces, tells};
use crate::contact::rolling::motion::Motion;

/// Least fraction of the vertical part of normal forces that is believed to be left after friction.
const LEFT_MIN: f64 = 0.25;

/// Can friction's share be forecast for this problem? The table must know its physics, and creepages be given.
pub(crate) fn can_forecast(problem: &Problem) -> bool {
    tells(&problem.elasticity, problem.interface, &problem.friction)
        && problem.forces.iter().all(|forces| *forces == [None; 2])
}

/// Vertical part of the tangential forces on a wheel relative to that of the normal ones, with every patch taken for the ellipse that
/// carries its load the same way. It is a start for rounds that solve the patches, so that patches far from ellipses have one too; nothing
/// where it is beyond belief.
pub(crate) fn forecast(
    problem: &Problem,
    geometry: &WheelRail,
    wheel: &WheelContact,
) -> Option<f64> {
    let mut lifted = 0.0;
    for gap in &wheel.patches {
        for [_, across] in patch_forces(problem, geometry, gap, wheel.centre)? {
            lifted -= across * gap.frame.angle.sin();
        }
    }
    let share = lifted / wheel.vertical_force();
    (share.is_finite() && 1.0 + share > LEFT_MIN).then_some(share)
}

/// Forces of friction on the rail in N along x and across, of each patch in a gap, with every patch taken for the ellipse that carries its load the
/// same way and the wheel's centre at a height in mm.
pub(crate) fn patch_forces(
    problem: &Problem,
    geometry: &WheelRail,
    gap: &GapContact,
    centre: f64,
) -> Option<Vec<[f64; 2]>> {
    let motion = match &problem.wheelset {
        None => *problem.motions.first()?,
        Some(wheelset) => motion_in(gap, geometry, centre, wheelset).ok()?,
    };
    let patches = gap.field.patches();
    let extents = patches.iter().map(|patch| patch.extent);
    let friction = in_frame(&problem.friction, &gap.frame, geometry, extents);
    let of_patch = |k: usize| {
        let ellipse = LoadEllipse::of_samples(&gap.field, k);
        let modulus = problem.interface.reduction * problem.elasticity.shear_modulus;
        let force = patches[k].normal_force;
        let limit = friction.limit_under(force, || LoadAcross::of_samples(&gap.field, k));
        let poisson_ratio = problem.elasticity.poisson_ratio;
        forces(modulus, poisson_ratio, &ellipse, limit, &motion)
    };
    Some((0..patches.len()).map(of_patch).collect())
}

/// Creepages and spin about the origin of a gap, with the wheel's centre at a height: those at its patches, weighted with their forces.
/// Between patches that share a gap the surfaces do not touch, so that the origin itself says nothing.
///
/// # Errors
/// Rail or wheel have no point over the load centre of a patch.
pub(crate) fn motion_in(
    gap: &GapContact,
    geometry: &WheelRail,
    centre: f64,
    wheelset: &WheelsetMotion,
) -> Result<Motion, SolveError> {
    let force = gap.normal_force();
    let mut motion = Motion {
        creepage_x: 0.0,
        creepage_y: 0.0,
        spin_per_mm: 0.0,
    };
    for (k, patch) in gap.field.patches().iter().enumerate() {
        let [x, y] = gap.field.load_centre(Some(k));
        let place = geometry.moved(&gap.frame, [x, y], centre)?;
        let [along, across, spin] = creepages(geometry, &place, centre, wheelset)?;
        let share = patch.normal_force / force;
        motion.creepage_x += share * (along + spin * y);
        motion.creepage_y += share * (across - spin * x);
        motion.spin_per_mm += share * spin;
    }
    Ok(motion)
}
