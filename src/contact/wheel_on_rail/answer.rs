//! The solution of a wheel on a rail, from its pressures and tractions.

use crate::error::SolveError;
use crate::geometry::reference_curve::{ReferenceCurve, RigidMotion};
use crate::normal::on_curve::CurveContact;
use crate::normal::wheel::WheelContact;
use crate::numerics::roots::bounds;
use crate::post::damage::{DamagedPatch, damage};
use crate::remark::entry::{RemarkEntry, merged};
use crate::remark::list::Remark;
use crate::rolling::task::Resolution;
use crate::slices::add_patches;
use crate::solution::assemble::normalised;
use crate::solution::finish::move_origin;
use crate::solution::words::answer::{
    ErrorEstimate, Fields, Origin, PatchFields, PatchSolution, Position, Solution, Total,
};
use crate::solution::words::damage::Damage;
use crate::wheel_on_rail::rounds::Found;
use crate::wheel_on_rail::tractions::{Part, PatchForces, creepages, each_cell};
use crate::wheel_on_rail::{WheelSolve, minus};

/// Error of the correction for the turn of the surface, relative to μN, per rad of the standard deviation of the angle over the load.
///
/// Compared with boundary elements of seven wheels on rails at μ = 0.3, the errors are 0.2 to 1.5 % for standard deviations of 0.07 to 0.5 rad. The
/// correction was fitted to half of these.
const ERROR_BY_TURN: f64 = 0.2;
/// Largest value of this error, relative to μN.
const TURN_ERROR_MAX: f64 = 0.035;
/// Growth of this error with the difference of the two bodies' shares of the displacement. On a bent surface the stiffness of a convex and of a
/// concave body changes in opposite directions, and the correction holds for their mean. The value was derived from boundary elements of single
/// bodies (about 2 in lateral forces). It was not compared with boundary elements of unequal pairs.
const ERROR_BY_UNEQUAL: f64 = 2.5;
/// Least coefficient of friction in the error of the lateral forces of pressures.
const FRICTION_LEAST: f64 = 0.3;
/// Description of axes, origins and signs.
const FRAME: &str = "every patch on the surface of the rail: x along rolling (leading edge at larger x), y to the left along the cross-section, \
                     z out of the rail, origin at its load centre; forces of a patch at its mean contact angle; total in track axes: x along \
                     rolling, y to the left, z up; forces, moments and tractions act on the lower body, slip is that of the upper body relative \
                     to the lower one";

/// Adds errors to the estimates of all forces of a motion: an error relative to the friction limit, and one of the pressures relative to them.
fn add_error(
    solution: &mut Solution,
    index: usize,
    [share, of_load]: [f64; 2],
    forces: &[PatchForces],
) {
    let mut all = ErrorEstimate::default();
    for (patch, forces) in solution.patches.iter_mut().zip(forces) {
        let limit = patch.friction_limit_n.unwrap_or(0.0);
        let open = ErrorEstimate {
            force_x_n: share * limit,
            force_y_n: share * limit,
            moment_z_n_mm: 0.0,
        };
        let point = &mut patch.points[index];
        point.error_estimate = point.error_estimate.map(|error| error.plus(open));
        let of_pressure =
            share * FRICTION_LEAST * patch.normal_force_n + of_load * forces.pressed[0].abs();
        all = all.plus(ErrorEstimate {
            force_y_n: open.force_y_n.max(of_pressure),
            ..open
        });
    }
    let total = &mut solution.total[index];
    total.error_estimate = total.error_estimate.map(|error| error.plus(all));
}

impl WheelSolve<'_> {
    /// Error of the correction for the turn of the surface, relative to the friction limit.
    fn turn_error(&self, contact: &CurveContact) -> f64 {
        if !self.is_corrected() {
            return 0.0;
        }
        let [_, deviation] = contact.angles();
        let unequal = (2.0 * self.case.problem.elasticity.lower_share - 1.0).abs();
        (1.0 + ERROR_BY_UNEQUAL * unequal) * (ERROR_BY_TURN * deviation).min(TURN_ERROR_MAX)
    }

    /// The solution of all parts.
    pub(super) fn answer(
        &self,
        found: Found,
        wheel: &WheelContact,
        seconds: f64,
    ) -> Result<(Solution, Fields), SolveError> {
        let Found {
            contact,
            parts,
            changes,
        } = found;
        let error = self.turn_error(&contact);
        let of_motions: Vec<_> = (0..changes.len())
            .map(|index| self.forces(&contact, &parts, index))
            .collect();
        let mut remarks = self.case.remarks.clone();
        remarks.extend(wheel.remarks.iter().cloned());
        if let Resolution::Target(target) = self.case.run.resolution
            && error > target
        {
            remarks.push(Remark::TargetBelowCurveError { target, error }.into());
        }
        let centre = load_centre_of_all(self.curve, &parts);
        let nothing = Total {
            force_x_n: 0.0,
            force_y_n: 0.0,
            force_z_n: Some(0.0),
            moment_z_n_mm: 0.0,
            error_estimate: Some(ErrorEstimate::default()),
            profile_uncertainty: None,
        };
        let mut totals = vec![nothing; changes.len()];
        let mut whole: Option<(Solution, Fields)> = None;
        for (number, part) in parts.iter().enumerate() {
            let (mut own, mut own_fields) = part.assembled(self.watch)?;
            let first = whole.as_ref().map_or(0, |(whole, _)| whole.patches.len());
            remarks.extend(own.remarks.iter().map(|remark| RemarkEntry {
                patch: remark.patch.map(|patch| patch + first),
                ..remark.clone()
            }));
            let [x, s] = part.origin;
            let arm = minus([x, self.curve.at(s).at[0]], centre);
            for (index, total) in totals.iter_mut().enumerate() {
                let [of_forces, of_load] = changes[index];
                let errors = [error + of_forces, of_load];
                add_error(&mut own, index, errors, &of_motions[index][number]);
                let both = total.error_estimate.zip(own.total[index].error_estimate);
                total.error_estimate = both.map(|(sum, error)| sum.plus(error.moved(arm)));
            }
            for k in 0..own.patches.len() {
                let forces: Vec<PatchForces> =
                    of_motions.iter().map(|forces| forces[number][k]).collect();
                for (index, total) in totals.iter_mut().enumerate() {
                    let [x, y, z] = forces[index].in_track();
                    total.force_x_n += x;
                    total.force_y_n += y;
                    total.force_z_n = total.force_z_n.map(|sum| sum + z);
                    total.moment_z_n_mm += self.moment(part, k, index, centre);
                }
                let cells = own_fields.patches.get_mut(k);
                self.add_patch(&contact, part, k, (&mut own.patches[k], cells), &forces)?;
            }
            add_patches(&mut whole, (own, own_fields));
        }
        let Some((mut solution, fields)) = whole else {
            unreachable!("a wheel at rest touches its rail")
        };
        if let Some(normal) = &mut solution.normal {
            normal.seconds = seconds;
        }
        let solution = Solution {
            total: totals,
            remarks: merged(remarks),
            wheel_lowering_mm: Some(wheel.lowering),
            origin: Origin {
                x_mm: centre[0],
                y_mm: centre[1],
                meaning: "load centre of all patches in track axes, for the total; the origin of a patch is in its position"
                    .to_owned(),
            },
            frame: FRAME.to_owned(),
            ..solution
        };
        Ok((solution, fields))
    }

    /// The moment of a patch in a motion about the vertical line through a point `[x, y]` of the track.
    fn moment(&self, part: &Part, k: usize, index: usize, about: [f64; 2]) -> f64 {
        let mut moment = 0.0;
        each_cell(part, k, index, |cell, _, area, [q_x, q_s, p]| {
            let place = self.curve.at(cell[1]);
            let (sin, cos) = place.angle.sin_cos();
            let across = q_s * cos + p * sin;
            moment += area * ((cell[0] - about[0]) * across - (place.at[0] - about[1]) * q_x);
        });
        moment
    }

    /// Adds the position of a patch, and for every motion its force at its mean angle and the motion at its load centre.
    fn add_patch(
        &self,
        contact: &CurveContact,
        part: &Part,
        k: usize,
        (patch, cells): (&mut PatchSolution, Option<&mut PatchFields>),
        forces: &[PatchForces],
    ) -> Result<(), SolveError> {
        let geometry = &self.contact.geometry;
        let centre = part.centres[k];
        let (place, over) = self.load_centre(contact, centre)?;
        let [_, y, z] = place.point(centre[0], 0.0);
        move_origin(patch, cells, minus(centre, part.origin));
        let load = &part.patches()[k];
        let limit = patch.friction_limit_n.unwrap_or(0.0);
        // All motions have the same pressures.
        let angle = forces[0].angle();
        patch.position = Some(Position {
            track_mm: [centre[0], y, z],
            rail_mm: geometry.on_rail(place.rail),
            wheel_mm: geometry.on_wheel(over.wheel),
            contact_angle_rad: angle,
            rolling_radius_mm: geometry.meridian(over.wheel).radius,
            origin_track_mm: [centre[0], y, z],
        });
        patch.approach_mm = load.approach;
        let problem = &self.case.problem;
        let (sin, cos) = angle.sin_cos();
        let points = patch.points.iter_mut().zip(forces);
        for ((point, forces), speed) in points.zip(&problem.speeds) {
            if let Some(wheelset) = &problem.wheelset {
                let rigid = RigidMotion::of_wheelset(geometry, contact.centre, wheelset);
                let motion = creepages(&rigid, centre[0], &place, &over);
                point.motion = motion;
                point.normalised = normalised(&problem.elasticity, patch.area_mm2, limit, &motion);
            }
            let [along, y_share, z_share] = forces.sheared;
            point.force_y_n = y_share * cos + z_share * sin;
            point.force_track_n = Some(forces.in_track());
            point.friction_power_without_spin_n = (point.motion.creepage_x * along).abs()
                + (point.motion.creepage_y * point.force_y_n).abs();
            if let Some(task) = &self.case.run.after.damage {
                let across = point.damage.take().and_then(|damage| damage.across);
                let of = DamagedPatch {
                    patch: load,
                    point,
                    limit,
                    speed: *speed,
                };
                point.damage = Some(Box::new(Damage {
                    across,
                    ..damage(task, of)
                }));
            }
        }
        Ok(())
    }
}

/// The turn of the surface from the first to the last strip in contact, in rad.
pub(super) fn turn(contact: &CurveContact) -> f64 {
    let nx = contact.grid.x.len();
    let rows = contact.pressure.chunks_exact(nx).zip(&contact.grid.places);
    let touching = rows.filter(|(row, _)| row.iter().any(|p| *p > 0.0));
    let [low, high] = bounds(touching.map(|(_, place)| place.angle));
    (high - low).max(0.0)
}

/// Mean position `[x, y]` of all patches in track axes, weighted with their normal forces.
fn load_centre_of_all(curve: &ReferenceCurve, parts: &[Part]) -> [f64; 2] {
    let (mut load, mut sum) = (0.0, [0.0; 2]);
    for part in parts {
        for k in 0..part.centres.len() {
            each_cell(part, k, 0, |[x, s], _, area, [.., p]| {
                load += area * p;
                sum = [sum[0] + area * p * x, sum[1] + area * p * curve.at(s).at[0]];
            });
        }
    }
    sum.map(|sum| sum / load.max(f64::MIN_POSITIVE))
}
