//! Solves a wheelset in all its positions.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::geometry::wheelset_pose::PairOfRails;
use crate::contact::monitor::{Monitor, MonitorPart};
use crate::contact::normal::wheel::{WheelTask, WheelsetTask};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::profile_assessment::trust;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::words::answer::{Fields, Solution};
use crate::contact::wheelset::balance::WheelsetSolve;
use crate::contact::wheelset::gather::WheelsetGathering;
use crate::contact::wheelset::kinematics;

/// Solves a wheelset in all its positions, and its kinematics where they are asked for.
///
/// # Errors
/// A named reason why there is no answer, with the wheel and the position; or the monitor stopped the work.
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
        let part = MonitorPart {
            inner: monitor,
            before: k as f64 / count as f64,
            own: 1.0 / count as f64,
        };
        let rigid = rails.pose(*shift, *yaw, roll);
        let rigid = rigid.map_err(|reason| SolveError::NormalProblem { reason })?;
        roll = rigid.roll;
        let case = CheckedCase {
            problem: case.problem.of_move(moving.motion, moving.drive_torque),
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

/// Both wheels with every automatic smoothing settled in the first position: one reading serves all positions.
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
