//! A motion of a sweep goes on from a mesh that the table of creep forces finds too coarse to a finer one, without companions and with one
//! rule.

use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::Work;
use crate::contact::rolling::mesh_plan::Regime;
use crate::contact::rolling::refinement::constants::MARGIN;
use crate::contact::rolling::refinement::level_solve::{JudgedAnswer, MotionTask};
use crate::contact::rolling::refinement::mesh_policy::HalfDoublings;
use crate::contact::rolling::refinement::refine::regime_of;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::refinement::swept_level::{self, LevelStart};
use crate::contact::rolling::refinement::warm_start::nested_tractions;
use crate::contact::rolling::task::RollingTask;

/// Solves a motion on the next finer mesh, from its answer on a coarser one, and gives the answer if the table tells that its error meets the
/// target. If not, or if there is no such mesh, its work is added to what is `lost`.
///
/// # Errors
/// The monitor may stop the work.
pub(super) fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    coarse: &JudgedAnswer,
    target: f64,
    lost: &mut Work,
    monitor: &dyn Monitor,
) -> Result<Option<JudgedAnswer>, SolveError> {
    let Some(excess) = coarse.indicators.excess_by_table(target) else {
        return Ok(None);
    };
    let below = state.levels.get(coarse.point.level);
    let cells = below.mesh.cells();
    if !state.policy.is_refinable(cells, HalfDoublings::NONE) {
        return Ok(None);
    }
    let regime = match regime_of(state, asked, &coarse.point) {
        Regime::Unknown => below.plan.regime,
        found => found,
    };
    let none = HalfDoublings::NONE;
    let (plan, _) = state
        .policy
        .next(cells, none, MARGIN * excess, regime, false);
    let number = state.levels.level(plan)?;
    let level = state.levels.get(number);
    state.carry_steps([coarse.point.level, number], false);
    let start = LevelStart {
        level: number,
        traction: nested_tractions(&below, &coarse.point.tangential.traction, &level),
        apart: &[0, 1].map(|_| vec![0.0; level.mesh.cells()]),
    };
    let finer = swept_level::solve(task, state, asked, &start, lost, monitor)?;
    let Some(mut finer) = finer else {
        return Ok(None);
    };
    if !finer.indicators.is_by_table() {
        lost.add(finer.point.work);
        return Ok(None);
    }
    finer.point.work.add_lost(coarse.point.work);
    finer.point.seconds += coarse.point.seconds;
    Ok(Some(finer))
}
