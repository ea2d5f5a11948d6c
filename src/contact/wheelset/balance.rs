//! Solves a wheelset on both rails in all its positions: its equilibrium under its load, and the sums over both wheels in track axes.
//!
//! The unknowns are the roll, at which both wheels give the same height of the centre, and the angular velocity, at which the rails balance a
//! torque. Each wheel carries a given vertical force, so that at a given roll each has its own height. The difference of the two heights decreases by
//! the distance of the contacts per radian. Torques over friction limit and radius grow with the slip over that of linear theory.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::wheelset_pose::{PairOfRails, RigidPose, WheelsetMotion};
use crate::monitor::{Monitor, MonitorPart};
use crate::normal::wheel::{WheelTask, WheelsetTask};
use crate::numerics::equilibrium::{Search, Trial};
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::Problem;
use crate::profile_assessment::trust;
use crate::remark::entry::{RemarkEntry, merged};
use crate::rolling::force_control::PLACE_MAX;
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::task::NEGLIGIBLE_OF_TARGET;
use crate::slices::add_patches;
use crate::solution::words::answer::{
    Fields, Kinematics, Origin, PatchSolution, Solution, Total, WheelOnRail, WheelsetAnswer,
    WheelsetPosition,
};
use crate::solution::words::damage::ProfileUncertainty;
use crate::surface_fallback;
use crate::wheel_force_control::{MISSED_LEAST, limit_and_law};
use crate::wheel_on_rail::SolvedWheel;
use crate::wheelset::kinematics;

/// Tolerance of the difference of the heights by both wheels in mm. It is a roll of 2e-7 rad, which moves a contact by 1e-4 mm.
const LEVEL: f64 = 3e-4;
/// Largest difference in mm that is accepted with a remark. It moves a contact by 5e-3 mm.
const LEVEL_POOR: f64 = 1e-2;

/// A wheelset to solve in one position.
pub(crate) struct WheelsetSolve<'a> {
    pub(crate) operators: &'a Arc<OperatorStore>,
    pub(crate) case: &'a CheckedCase,
    pub(crate) task: &'a WheelsetTask,
    /// Left and right wheel, with settled smoothing.
    pub(crate) sides: &'a [WheelTask; 2],
    pub(crate) monitor: &'a dyn Monitor,
}

/// A wheelset in equilibrium.
pub(crate) struct AtRest {
    /// Shift in mm, yaw and roll in rad.
    pub(crate) pose: [f64; 3],
    /// Height of the centre in mm.
    pub(crate) height: f64,
    /// Angular velocity about the axle in rad/s.
    pub(crate) angular_velocity: f64,
    /// Torque about the axle in N mm that balances the forces of the rails.
    pub(crate) torque: f64,
    /// Left and right.
    pub(crate) sides: [SolvedWheel; 2],
}

/// Both wheels solved at one roll and one angular velocity.
struct Both {
    /// Shift in mm, yaw and roll in rad.
    pose: [f64; 3],
    angular_velocity: f64,
    wheels: [WheelTask; 2],
    cases: [CheckedCase; 2],
    found: [SolvedWheel; 2],
}

impl Both {
    /// Height of the centre by the left wheel above that by the right one, in mm.
    fn above(&self) -> f64 {
        self.found[0].wheel.centre - self.found[1].wheel.centre
    }

    /// Height of the centre in mm.
    fn height(&self) -> f64 {
        0.5 * (self.found[0].wheel.centre + self.found[1].wheel.centre)
    }

    /// Torque of the rails on the wheelset about its axle in N mm, positive if it drives forward.
    fn torque_of_rails(&self) -> f64 {
        let axle = self.wheels[0].geometry.axle();
        let centre = [0.0, self.pose[0], self.height()];
        let patches = self.found.iter().flat_map(|found| &found.solution.patches);
        patches.map(|patch| torque(patch, centre, axle)).sum()
    }
}

impl WheelsetSolve<'_> {
    /// Finds the equilibrium in a position. If the curve of a rail has no answer and the case does not ask for it, both wheels are solved on planes.
    ///
    /// # Errors
    /// Returns the errors of [`at_rest`](Self::at_rest).
    pub(crate) fn on_either_surface(&self, rigid: &RigidPose) -> Result<AtRest, SolveError> {
        let error = match self.at_rest(rigid) {
            Ok(found) => return Ok(found),
            Err(error) => error,
        };
        let remark = surface_fallback::fallback(&self.sides[0], error)?;
        let planes = WheelsetSolve {
            sides: &[self.sides[0].on_planes(), self.sides[1].on_planes()],
            ..*self
        };
        let mut found = planes.at_rest(rigid)?;
        let remarks = found
            .sides
            .iter_mut()
            .map(|side| &mut side.solution.remarks);
        remarks.for_each(|remarks| remarks.push(remark.clone()));
        Ok(found)
    }

    /// Finds the equilibrium in a position, starting from the rigid wheelset.
    ///
    /// # Errors
    /// Returns the reason why there is no answer, with the wheel and the position.
    pub(crate) fn at_rest(&self, rigid: &RigidPose) -> Result<AtRest, SolveError> {
        let problem = &self.case.problem;
        let Some(motion) = problem.wheelset else {
            return Err(SolveError::normal_problem("a wheelset has no motion"));
        };
        let both = self.balanced(rigid, &motion, problem.drive_torque)?;
        let (height, torque) = (both.height(), -both.torque_of_rails());
        let Both {
            pose,
            angular_velocity,
            wheels,
            cases,
            found: [left, right],
        } = both;
        let trusted = |found: SolvedWheel, k: usize| {
            trust::trusted(self.operators, &cases[k], &wheels[k], found, self.monitor)
                .map_err(|error| self.of_side(error, k, pose))
        };
        Ok(AtRest {
            pose,
            height,
            angular_velocity,
            torque,
            sides: [trusted(left, 0)?, trusted(right, 1)?],
        })
    }

    /// Both wheels at the roll at which their heights agree. If a torque is given, the angular velocity is that at which the rails balance it.
    fn balanced(
        &self,
        rigid: &RigidPose,
        motion: &WheelsetMotion,
        torque: Option<f64>,
    ) -> Result<Both, SolveError> {
        let radius = 0.5 * (rigid.touches[0].radius + rigid.touches[1].radius);
        let target = self.case.run.resolution.target_or_usual();
        let tolerance = (NEGLIGIBLE_OF_TARGET * target).max(MISSED_LEAST);
        let per_mm = tolerance / LEVEL;
        // The unit of slip in the search: the slip at which linear theory reaches the friction limit.
        let mut unit = None;
        let scale = [
            Some(-1.0 / (per_mm * rigid.contact_distance())),
            torque.map(|_| 1.0),
        ];
        let limit = [f64::INFINITY, PLACE_MAX];
        let found = Search::new(scale, limit).find([rigid.roll, 0.0], |[roll, place]| {
            let pose = [rigid.lateral_shift, rigid.yaw, roll];
            let angular_velocity = match torque {
                Some(_) => motion.speed / radius * (1.0 + unit.unwrap_or(0.0) * place),
                None => motion.angular_velocity,
            };
            let moving = WheelsetMotion {
                angular_velocity,
                ..*motion
            };
            let both = self.both(pose, &moving)?;
            let patches = both.found.iter().flat_map(|found| &found.solution.patches);
            let (limit, law) = limit_and_law(&self.case.problem, patches);
            unit.get_or_insert(1.0 / law.stiffness[0]);
            let missed = torque.map_or(0.0, |torque| -(torque + both.torque_of_rails()));
            let missed = missed / (limit * radius).max(1.0);
            Ok::<_, SolveError>(Trial {
                residual: [per_mm * both.above(), missed],
                tolerance,
                value: (both, missed.abs() <= tolerance),
            })
        })?;
        let (remark, reason) = (
            found.inexact("the balance of the wheelset"),
            found.end.reason(),
        );
        let (mut both, is_driven) = found.value;
        let above = both.above();
        let failure = match torque.filter(|_| !is_driven) {
            Some(torque) => format!(
                "no angular velocity was found at which the rails balance a drive torque of {torque} N mm: {reason}; friction may not carry it"
            ),
            None if above.abs() > LEVEL_POOR => format!(
                "no roll was found at which both wheels carry their loads: their heights still differ by {above:.4} mm, {reason}"
            ),
            None => {
                let remarks = &mut both.found[0].solution.remarks;
                remarks.extend(remark.map(RemarkEntry::from));
                return Ok(both);
            }
        };
        Err(SolveError::normal_problem(format!(
            "at a lateral shift of {} mm {failure}",
            rigid.lateral_shift
        )))
    }

    /// Both wheels at a shift, a yaw and a roll.
    fn both(&self, pose: [f64; 3], motion: &WheelsetMotion) -> Result<Both, SolveError> {
        let wheel = |k: usize| {
            let side = &self.sides[k];
            WheelTask {
                geometry: side.geometry.posed(pose[0], pose[1], pose[2]),
                ..side.clone()
            }
        };
        let wheels = [wheel(0), wheel(1)];
        let case = |k: usize| CheckedCase {
            problem: Problem {
                wheelset: Some(*motion),
                drive_torque: None,
                ..self.case.problem.with_wheel(Arc::new(wheels[k].clone()))
            },
            run: self.case.run.clone(),
            label: self.case.label.clone(),
            // The remarks of the case are reported once for the whole wheelset.
            remarks: Vec::new(),
        };
        let cases = [case(0), case(1)];
        let found = |k: usize| {
            let found = trust::judged(self.operators, &cases[k], &wheels[k], self.monitor);
            found.map_err(|error| self.of_side(error, k, pose))
        };
        let found = [found(0)?, found(1)?];
        Ok(Both {
            pose,
            angular_velocity: motion.angular_velocity,
            wheels,
            cases,
            found,
        })
    }

    /// An error with the wheel and the position it belongs to.
    fn of_side(&self, error: SolveError, side: usize, pose: [f64; 3]) -> SolveError {
        let name = ["left", "right"][side];
        let place = format!("the {name} wheel at a lateral shift of {} mm", pose[0]);
        match error {
            SolveError::NormalProblem { reason } => {
                SolveError::normal_problem(format!("{place}: {reason}"))
            }
            SolveError::RoughProfile { pointer, reason } => SolveError::RoughProfile {
                pointer: if side == 1 {
                    self.task.pointer_on_right(&pointer)
                } else {
                    pointer
                },
                reason: format!("{place}: {reason}"),
            },
            other => other,
        }
    }
}

/// Torque of the rail on the wheelset about its axle in N mm, due to the force of one patch at its load centre.
fn torque(patch: &PatchSolution, centre: [f64; 3], axle: [f64; 3]) -> f64 {
    let (Some(position), Some(point)) = (&patch.position, patch.points.first()) else {
        return 0.0;
    };
    let Some(force) = point.force_track_n else {
        return 0.0;
    };
    let (sin, cos) = position.contact_angle_rad.sin_cos();
    let arm = [0, 1, 2].map(|k| position.track_mm[k] - centre[k]);
    // This is the moment of the wheel on the rail. The moment on the wheelset is the opposite.
    let moment = [
        arm[1] * force[2] - arm[2] * force[1],
        arm[2] * force[0] - arm[0] * force[2],
        arm[0] * force[1] - arm[1] * force[0],
    ];
    let spin = point.moment_z_n_mm * (axle[2] * cos - axle[1] * sin);
    -((0..3).map(|k| axle[k] * moment[k]).sum::<f64>() + spin)
}

/// The combined solution of the positions solved so far.
pub(crate) struct WheelsetGathering<'a> {
    case: &'a CheckedCase,
    task: &'a WheelsetTask,
    positions: Vec<WheelsetPosition>,
    total: Vec<Total>,
    remarks: Vec<RemarkEntry>,
    whole: Option<(Solution, Fields)>,
}

impl<'a> WheelsetGathering<'a> {
    pub(crate) fn new(case: &'a CheckedCase, task: &'a WheelsetTask) -> WheelsetGathering<'a> {
        WheelsetGathering {
            case,
            task,
            positions: Vec::new(),
            total: Vec::new(),
            remarks: case.remarks.clone(),
            whole: None,
        }
    }

    /// Adds the next position.
    pub(crate) fn add(&mut self, at_rest: AtRest) {
        let AtRest {
            pose: [lateral_shift_mm, yaw_rad, roll_rad],
            height,
            angular_velocity,
            torque,
            sides: [left, right],
        } = at_rest;
        let mut wheels = Vec::with_capacity(2);
        for (k, found) in [left, right].into_iter().enumerate() {
            let total = about_middle(&found.solution);
            wheels.push(self.wheel(k, found.solution, found.fields, &total));
            match (k, self.total.last_mut()) {
                (1, Some(sum)) => *sum = plus(sum, &total),
                _ => self.total.push(total),
            }
        }
        let mut wheels = wheels.into_iter();
        let (Some(left), Some(right)) = (wheels.next(), wheels.next()) else {
            return;
        };
        self.positions.push(WheelsetPosition {
            lateral_shift_mm,
            yaw_rad,
            roll_rad,
            centre_height_mm: height,
            angular_velocity_rad_per_s: angular_velocity,
            drive_torque_n_mm: torque,
            radius_difference_mm: left.rolling_radius_mm - right.rolling_radius_mm,
            left,
            right,
        });
    }

    /// Adds the patches of one wheel and returns its summary.
    fn wheel(
        &mut self,
        side: usize,
        mut solution: Solution,
        fields: Fields,
        total: &Total,
    ) -> WheelOnRail {
        let first = self.whole.as_ref().map_or(0, |(all, _)| all.patches.len());
        let count = solution.patches.len();
        let remarks = std::mem::take(&mut solution.remarks);
        self.remarks.extend(remarks.into_iter().map(|remark| {
            let pointer = remark.pointer.map(|pointer| match side {
                1 => self.task.pointer_on_right(&pointer),
                _ => pointer,
            });
            // A remark on all patches of a wheel is attached to the first one.
            let patch = Some(first + remark.patch.unwrap_or(0));
            RemarkEntry {
                patch,
                pointer,
                ..remark
            }
        }));
        let main = solution
            .patches
            .iter()
            .max_by(|a, b| a.normal_force_n.total_cmp(&b.normal_force_n));
        let place = main.and_then(|patch: &PatchSolution| patch.position);
        let lowering = solution.wheel_lowering_mm.take();
        add_patches(&mut self.whole, (solution, fields));
        WheelOnRail {
            patches: (first..first + count).collect(),
            rolling_radius_mm: place.map_or(0.0, |place| place.rolling_radius_mm),
            contact_angle_rad: place.map_or(0.0, |place| place.contact_angle_rad),
            wheel_lowering_mm: lowering.unwrap_or(0.0),
            force_x_n: total.force_x_n,
            force_y_n: total.force_y_n,
            force_z_n: total.force_z_n.unwrap_or(0.0),
            moment_z_n_mm: total.moment_z_n_mm,
        }
    }

    /// The combined solution, with the kinematics if they were requested.
    pub(crate) fn finish(self, kinematics: Option<Kinematics>) -> (Solution, Fields) {
        let Some((solution, fields)) = self.whole else {
            unreachable!("a wheelset has at least one position")
        };
        let solution = Solution {
            total: self.total,
            remarks: merged(self.remarks),
            wheel_lowering_mm: None,
            wheelset: Some(Box::new(WheelsetAnswer {
                positions: self.positions,
                kinematics: kinematics.map(Box::new),
            })),
            origin: Origin {
                x_mm: 0.0,
                y_mm: 0.0,
                meaning: "middle of the track in track axes, for the totals; the origin of a patch is in its position"
                    .to_owned(),
            },
            case_digest: self.case.label.digest.clone(),
            ..solution
        };
        (solution, fields)
    }
}

/// The total of a wheel with its moment about the vertical line through the middle of the track.
fn about_middle(solution: &Solution) -> Total {
    let [x, y] = [solution.origin.x_mm, solution.origin.y_mm];
    let total = solution.total.first().copied();
    let Some(total) = total else {
        unreachable!("a solved wheel has a total")
    };
    Total {
        moment_z_n_mm: total.moment_z_n_mm + x * total.force_y_n - y * total.force_x_n,
        error_estimate: total.error_estimate.map(|error| error.moved([x, y])),
        ..total
    }
}

/// The sums over two wheels. The sums of their errors are upper bounds.
fn plus(one: &Total, other: &Total) -> Total {
    Total {
        force_x_n: one.force_x_n + other.force_x_n,
        force_y_n: one.force_y_n + other.force_y_n,
        force_z_n: one.force_z_n.zip(other.force_z_n).map(|(a, b)| a + b),
        moment_z_n_mm: one.moment_z_n_mm + other.moment_z_n_mm,
        error_estimate: one
            .error_estimate
            .zip(other.error_estimate)
            .map(|(a, b)| a.plus(b)),
        profile_uncertainty: one.profile_uncertainty.zip(other.profile_uncertainty).map(
            |(a, b)| ProfileUncertainty {
                force_x_n: a.force_x_n + b.force_x_n,
                force_y_n: a.force_y_n + b.force_y_n,
                pressure_max_mpa: a.pressure_max_mpa.max(b.pressure_max_mpa),
            },
        ),
    }
}

/// Solves a wheelset in all its positions, and its kinematics if they are requested.
///
/// # Errors
/// Returns the reason why there is no answer, with the wheel and the position, or an error if the monitor stopped the work.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    task: &WheelsetTask,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let sides = settled(case, task, monitor)?;
    let mut rails = PairOfRails::new([sides[0].geometry.clone(), sides[1].geometry.clone()]);
    let mut gathering = WheelsetGathering::new(case, task);
    let count = task.poses.len();
    let mut roll = 0.0;
    let places = task.poses.iter().zip(&task.moves).enumerate();
    for (k, ([shift, yaw], moving)) in places {
        let part = MonitorPart::new(monitor, k as f64 / count as f64, 1.0 / count as f64);
        let rigid = rails.pose(*shift, *yaw, roll);
        let rigid = rigid.map_err(SolveError::normal_problem)?;
        roll = rigid.roll;
        let case = CheckedCase {
            problem: Problem {
                wheelset: Some(moving.motion),
                drive_torque: moving.drive_torque,
                speeds: vec![Some(moving.motion.speed)],
                ..case.problem.clone()
            },
            ..case.clone()
        };
        let solve = WheelsetSolve {
            operators,
            case: &case,
            task,
            sides: &sides,
            monitor: &part,
        };
        gathering.add(solve.on_either_surface(&rigid)?);
    }
    let kinematics = match &task.kinematics {
        None => None,
        Some(asked) => Some(kinematics::of(&mut rails, &sides, asked, monitor)?),
    };
    Ok(gathering.finish(kinematics))
}

/// Both wheels with every automatic smoothing replaced by the length found in the first position.
fn settled(
    case: &CheckedCase,
    task: &WheelsetTask,
    monitor: &dyn Monitor,
) -> Result<[WheelTask; 2], SolveError> {
    let settle = |k: usize| {
        let side = &task.sides[k];
        let settled = trust::settled(case, side, monitor)?;
        Ok::<_, SolveError>(settled.unwrap_or_else(|| side.clone()))
    };
    Ok([settle(0)?, settle(1)?])
}
