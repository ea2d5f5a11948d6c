//! The error of the forces due to the plane of contact where the rail bends under a patch: in the creepages, and in the direction of the
//! normals.
//!
//! Creepages: across a patch the places of wheel and rail have a contact angle and a rolling radius of their own, so that their creepages are
//! not those of a rigid motion in the plane. Each strip is given the force of a saturating law `F = L w / √(w² + w₀²)` of its share L of the
//! friction limit, with w₀ where Kalker's linear theory reaches the limit. The differences between the forces at the creepages of its own
//! place and at those of the plane are summed.
//!
//! Normals: pressure and tractions act in the axes of the plane. Each strip is given the axes of the rail's surface under it, and the
//! differences of its forces are summed.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::geometry::wheelset::{WheelsetMotion, creepages};
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::resolution::Resolution;
use crate::contact::solution::words::answer::{PatchSolution, Solution};
use crate::contact::solution::words::fields::Fields;

/// Strips of a patch over which creepages are compared.
const STRIPS: usize = 9;
/// Strips of a patch over which directions are compared. Six integrate the load of an ellipse to 1 %.
const STRIPS_OF_NORMALS: usize = 6;
/// Kalker's C₁₁ of a circle at ν = 0.28.
const C11: f64 = 4.3;
/// A share of μN from which a remark says so; on treads where the rail's radius changes under the patch it is often half of this.
const TOLD: f64 = 0.02;

/// What the plane leaves open of a wheel on its rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConformalityError {
    /// Length of the difference of the forces in N.
    force: f64,
    /// The part of it due to the direction of the normals, in N.
    normals: f64,
    /// Friction limit of all patches in N.
    limit: f64,
    /// Largest inclination of the rail under a patch to its plane in rad.
    turn: f64,
}

impl ConformalityError {
    /// The remark on it, if it is large and more than the target of the forces.
    pub(crate) fn remark(&self, case: &CheckedCase) -> Option<Remark> {
        let least = match case.run.resolution {
            Resolution::Target(target) => target.max(TOLD),
            Resolution::Mesh(_) => TOLD,
        };
        let share = self.force / self.limit;
        (self.limit > 0.0 && share > least).then_some(Remark::PlaneOfContact {
            share,
            of_normals: self.normals / self.limit,
            turn_rad: self.turn,
        })
    }
}

/// What the plane leaves open of the total, over all gaps; `answers` in the order of the wheel's gaps. Creepages that the case gives are
/// those of the plane, so that they leave nothing open.
pub(crate) fn of_wheel(
    case: &CheckedCase,
    geometry: &WheelRail,
    wheel: &WheelContact,
    answers: &[(Solution, Fields)],
) -> ConformalityError {
    let (mut along, mut across, mut limit, mut turn) = (0.0_f64, 0.0_f64, 0.0, 0.0_f64);
    let mut normals = [0.0; 2];
    for (gap, (solution, _)) in wheel.patches.iter().zip(answers) {
        let place = GapPlace {
            wheelset: case.problem.wheelset.as_ref(),
            modulus: case.problem.elasticity.shear_modulus,
            geometry,
            gap,
            centre: wheel.centre,
        };
        let mut own = [0.0; 2];
        for (k, patch) in solution.patches.iter().enumerate() {
            let differences = place.of_motion(k, patch);
            own = [0, 1].map(|i| own[i] + differences[i]);
            let (turned_forces, turned) = place.of_normals(k, patch);
            normals = [0, 1].map(|i| normals[i] + turned_forces[i]);
            turn = turn.max(turned);
            limit += patch.friction_limit_n.unwrap_or(0.0);
        }
        along += own[0].abs();
        across += own[1].abs();
    }
    let normals = normals[0].hypot(normals[1]);
    // How it is divided among both components depends on the law more than its length does.
    ConformalityError {
        force: along.hypot(across).hypot(normals),
        normals,
        limit,
        turn,
    }
}

/// The contact in one gap, with the height of the wheel.
struct GapPlace<'a> {
    wheelset: Option<&'a WheelsetMotion>,
    /// Shear modulus in MPa.
    modulus: f64,
    geometry: &'a WheelRail,
    gap: &'a GapContact,
    centre: f64,
}

impl GapPlace<'_> {
    /// Differences of the tangential forces along and across in the plane in N, due to creepages that vary over the patch.
    fn of_motion(&self, k: usize, patch: &PatchSolution) -> [f64; 2] {
        let Some(wheelset) = self.wheelset else {
            return [0.0; 2];
        };
        let [.., low, high] = patch.extent_mm;
        let x = self.gap.field.load_centre(Some(k))[0];
        let limit = patch.friction_limit_n.unwrap_or(0.0);
        let unit = limit / (C11 * self.modulus * patch.area_mm2 / std::f64::consts::PI);
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        for j in 0..STRIPS {
            let t = (2 * j + 1) as f64 / STRIPS as f64 - 1.0;
            // The load of a strip of an ellipse.
            let weight = 1.0 - t * t;
            let y = 0.5 * (low + high) + 0.5 * t * (high - low);
            let Ok(place) = self.geometry.moved(&self.gap.frame, [x, y], self.centre) else {
                continue;
            };
            let [dy, dz] = self.geometry.rail_at(place.rail).slope;
            let own = Frame {
                angle: (dz / dy).atan(),
                ..place
            };
            weights += weight;
            let [with, without] = self.forces(wheelset, patch, &own, [x, y], unit);
            sum[0] += weight * limit * (with[0] - without[0]);
            sum[1] += weight * limit * (with[1] - without[1]);
        }
        sum.map(|part| part / weights.max(f64::MIN_POSITIVE))
    }

    /// Difference of the force across the track and upward in N if pressure and tractions had the direction of the rail's surface under
    /// every strip, and the largest inclination of the rail to the plane in rad. Tractions are taken in proportion to the pressure.
    fn of_normals(&self, k: usize, patch: &PatchSolution) -> ([f64; 2], f64) {
        let plane = self.gap.frame.angle;
        let lateral = patch.points.first().map_or(0.0, |point| point.force_y_n);
        let (mut difference, mut turn) = ([0.0; 2], 0.0_f64);
        for [y, pressed] in self.gap.strip_loads(k, STRIPS_OF_NORMALS) {
            let Ok(rail) = self.geometry.rail_over(&self.gap.frame, y) else {
                continue;
            };
            let [dy, dz] = self.geometry.rail_at(rail).slope;
            let angle = (dz / dy).atan();
            let pulled = lateral * pressed / patch.normal_force_n;
            // F_y = P sin α + T cos α, F_z = T sin α − P cos α
            let [sin, cos] = [angle.sin() - plane.sin(), angle.cos() - plane.cos()];
            difference[0] += pressed * sin + pulled * cos;
            difference[1] += pulled * sin - pressed * cos;
            turn = turn.max((angle - plane).abs());
        }
        (difference, turn)
    }

    /// Forces over the limit with the creepages of a place and with those of the plane there.
    fn forces(
        &self,
        wheelset: &WheelsetMotion,
        patch: &PatchSolution,
        own: &Frame,
        [x, y]: [f64; 2],
        unit: f64,
    ) -> [[f64; 2]; 2] {
        let found = creepages(self.geometry, own, self.centre, wheelset);
        let (Ok([along, across, _]), Some(point)) = (found, patch.points.first()) else {
            return [[0.0; 2]; 2];
        };
        let motion = &point.motion;
        let in_plane = [
            motion.creepage_x - motion.spin_per_mm * y,
            motion.creepage_y + motion.spin_per_mm * x,
        ];
        [[along, across], in_plane].map(|[a, b]| {
            let length = (a * a + b * b + unit * unit).sqrt().max(f64::MIN_POSITIVE);
            [a / length, b / length]
        })
    }
}
