//! Levels on which the trapezoid rule is solved alone: those of a motion by itself that begin near their answer, on a coarser level.
//!
//! Elsewhere the three-point rule is solved first, because it converges from anywhere, and its difference tells of the error. Here that difference
//! is carried on from the last level with both rules, less in proportion to the cells. On the 400 ellipses of `benches/calibrate` at four
//! targets, such estimates cover .96 to .99 of either half.

use crate::contact::method::Method;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::{LevelAnswer, LevelFailure, Work};
use crate::contact::rolling::methods::boundary_element::solve as boundary_element;
use crate::contact::rolling::methods::boundary_element::task::LevelTask;
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::refinement::warm_start::nested_tractions;
use crate::contact::rolling::resolution::Resolution;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// Newton steps of the one rule from such a start. Of 163 starts on the 62 reference ellipses 145 took 1 to 4 steps, 3 took 5 to 7, and the
/// others had not converged after 8.
const STEPS_MAX: u32 = 5;

/// Bodies that differ by a |K| of more than this keep both rules: with one, free rolling at |K| = 0.25 is off by 1.2 estimates. Where they hardly
/// differ, forces are to be those of like bodies. Chosen by judgement below every |K| of the references, the least of which is 0.05.
const UNLIKE_MAX: f64 = 0.02;

/// Is one rule enough on levels with a coarser one below? Bounds that follow the slips need the smooth slips of the other rule, motions of a
/// sweep start from both, and estimates with a layer between the bodies, or for bodies that differ much, were fitted with both.
#[must_use]
pub(crate) fn is_enough(task: &RollingTask, asked: &LevelTask) -> bool {
    task.single_motion
        && task.method == Method::BoundaryElement
        && matches!(task.resolution, Resolution::Target(_))
        && !task.has_prescribed_forces()
        && task.interface.layer == 0.0
        && !(task.is_coupled() && task.elasticity.difference.abs() > UNLIKE_MAX)
        && asked.fall.is_none()
        && asked.passage.is_none()
}

/// Solves a level with one rule from the answer on a coarser one, if that is enough and takes few steps; the work in any case.
///
/// # Errors
/// The monitor may stop the work.
pub(crate) fn attempt(
    task: &RollingTask,
    asked: LevelTask,
    (coarse, answer): (&StripMesh, &LevelAnswer),
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<(Option<LevelAnswer>, Work), LevelFailure> {
    let level = asked.level;
    if !is_enough(task, &asked) {
        return Ok((None, Work::default()));
    }
    let start = nested_tractions(coarse, &answer.traction, level);
    boundary_element::trapezoid_of_motion(asked, &start, STEPS_MAX, workspace, monitor)
}
