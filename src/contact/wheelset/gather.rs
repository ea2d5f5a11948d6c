//! Gathers the answers for both wheels in all positions into one, with the sums in track axes.

use crate::contact::normal::wheel::WheelsetTask;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::solution::words::answer::{
    ErrorEstimate, Fields, Kinematics, Origin, PatchSolution, Solution, Total, WheelOnRail,
    WheelsetAnswer, WheelsetPosition,
};
use crate::contact::solution::words::damage::ProfileUncertainty;
use crate::contact::wheelset::balance::AtRest;

/// The answers so far.
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

    /// Adds the patches of one wheel and says what it does on its rail.
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
            // A remark on all patches of a wheel is told at the first.
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
        match &mut self.whole {
            None => self.whole = Some((solution, fields)),
            Some((all, all_fields)) => {
                all.normal = all.normal.zip(solution.normal).map(|(a, b)| a.with(b));
                all.patches.extend(solution.patches);
                all_fields.patches.extend(fields.patches);
            }
        }
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

    /// The answer, with the kinematics if they were asked for.
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
        error_estimate: total.error_estimate.map(|error| ErrorEstimate {
            moment_z_n_mm: error.moment_z_n_mm
                + x.abs() * error.force_y_n
                + y.abs() * error.force_x_n,
            ..error
        }),
        ..total
    }
}

/// The sums over two wheels; their errors are added, which they do not exceed.
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
