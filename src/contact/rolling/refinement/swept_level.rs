//! A motion of a sweep on one level, with the trapezoid rule alone.

use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::{LevelFailure, Work};
use crate::contact::rolling::methods::boundary_element::solve as boundary_element;
use crate::contact::rolling::methods::boundary_element::task::FEW_STEPS;
use crate::contact::rolling::refinement::level_solve::{
    JudgedAnswer, MotionTask, answer_on, level_task,
};
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::task::RollingTask;

/// Where a motion starts on a level.
pub(super) struct LevelStart<'a> {
    /// Number of the level.
    pub(super) level: usize,
    pub(super) traction: [Vec<f64>; 2],
    /// By how much tractions of the three-point rule are taken to differ, for starts of later motions.
    pub(super) apart: &'a [Vec<f64>; 2],
}

/// Solves a motion with the trapezoid rule, if that takes few steps; if not, the work is `lost`. The tractions are remembered for the next
/// motions on the level.
///
/// # Errors
/// The monitor may stop the work.
pub(super) fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    start: &LevelStart,
    lost: &mut Work,
    monitor: &dyn Monitor,
) -> Result<Option<JudgedAnswer>, SolveError> {
    let began = monitor.elapsed();
    let level = state.levels.used(start.level);
    let motion = level.scale.motion(&asked.motion);
    let of_level = level_task(task, &level, &motion, asked.index);
    let (from, workspace) = (&start.traction, &mut state.workspace);
    let found =
        boundary_element::trapezoid_of_motion(of_level, from, FEW_STEPS, workspace, monitor);
    let tangential = match found {
        Ok((Some(tangential), _)) => tangential,
        Ok((None, work)) | Err(LevelFailure::NotConverged { work, .. }) => {
            lost.add(work);
            return Ok(None);
        }
        Err(LevelFailure::Stopped(stop)) => return Err(stop.into()),
    };
    let sweep = &mut state.sweep;
    sweep.remember_alone(start.level, motion, &tangential.traction, start.apart);
    let mut solved = answer_on(task, state, start.level, asked, tangential, None);
    solved.point.seconds = (monitor.elapsed() - began).as_secs_f64();
    Ok(Some(solved))
}
