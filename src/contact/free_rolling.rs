//! Free rolling of a wheelset on prescribed forces: the angular and the lateral velocity that have given mean creepages.

use crate::contact::geometry::wheel_rail::Placement;
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::rolling::motion::PrescribedForces;
use crate::contact::solution::words::answer::PatchSolution;

/// The motion of a wheelset without mean creepage, weighted with the loads of the patches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FreeRollingState {
    /// Rolling radius in mm.
    radius: f64,
    /// Lateral velocity over the speed.
    drift: f64,
    /// Lateral creepage over the rest of the lateral velocity: the cosine of the contact angle.
    across: f64,
}

impl FreeRollingState {
    /// What is known before patches are: near the tread lateral creepage is that of the yaw.
    pub(crate) fn about(placement: &Placement) -> FreeRollingState {
        FreeRollingState {
            radius: placement.rolling_radius,
            drift: placement.yaw,
            across: 1.0,
        }
    }

    /// The same from patches at the motion of this one.
    pub(crate) fn of(self, patches: &[PatchSolution]) -> FreeRollingState {
        let (mut load, mut moment, mut sliding, mut across) = (0.0, 0.0, 0.0, 0.0);
        for patch in patches {
            let force = patch.normal_force_n;
            let creepage = patch.points.first().map(|point| point.motion.creepage_y);
            load += force;
            moment += force * radius_of(patch);
            sliding += force * creepage.unwrap_or(0.0);
            across += force * angle_of(patch).cos();
        }
        FreeRollingState {
            radius: moment / load,
            drift: self.drift - sliding / across,
            across: across / load,
        }
    }

    /// A motion with creepages on the mean where its forces are prescribed.
    pub(crate) fn at(
        &self,
        mut wheelset: WheelsetMotion,
        creepages: [f64; 2],
        forces: PrescribedForces,
    ) -> WheelsetMotion {
        let [along, across] = forces.map(|force| force.is_some());
        if along {
            wheelset.angular_velocity = wheelset.speed * (1.0 - creepages[0]) / self.radius;
        }
        if across {
            wheelset.lateral_velocity = wheelset.speed * (self.drift + creepages[1] / self.across);
        }
        wheelset
    }
}

/// The contact angle of a patch in rad.
pub(crate) fn angle_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(0.0, |position| position.contact_angle_rad)
}

fn radius_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(1.0, |position| position.rolling_radius_mm)
}
