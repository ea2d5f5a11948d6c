//! Companions of a mesh: meshes with half its strips, and with half its cells, for the same motion. Their differences to the mesh
//! measure its error across and along the strips separately.

use crate::contact::error::SolveError;
use crate::contact::mesh::size::MeshSize;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::{LevelAnswer, LevelFailure, Work};
use crate::contact::rolling::mesh_plan::MeshPlan;
use crate::contact::rolling::methods::boundary_element::solve as boundary_element;
use crate::contact::rolling::refinement::companion_answer::CompanionAnswer;
use crate::contact::rolling::refinement::level_solve::{MotionTask, level_task};
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::refinement::warm_start::nested_tractions;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// Which side of a mesh is halved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Companion {
    /// Half the strips.
    Across,
    /// Half the cells in each.
    Along,
}

impl Companion {
    /// The plan of the companion: same regime and pole, an even number of strips that is about half.
    fn plan(self, plan: MeshPlan) -> Option<MeshPlan> {
        let MeshSize { strips, cells } = plan.size;
        let size = match self {
            Companion::Across => MeshSize {
                strips: 2 * ((strips + 2) / 4),
                cells,
            },
            Companion::Along => MeshSize {
                strips,
                cells: cells.div_ceil(2),
            },
        };
        let halved = size.strips >= 2 && size.cells >= 2 && size != plan.size;
        halved.then_some(MeshPlan { size, ..plan })
    }

    /// The factor of [`CompanionAnswer::Found`]. Strips are kept even, so that half of six are four.
    fn reach(self, fine: MeshSize, halved: MeshSize) -> f64 {
        let (fine, halved) = match self {
            Companion::Across => (fine.strips, halved.strips),
            Companion::Along => (fine.cells, halved.cells),
        };
        3.0 / ((f64::from(fine) / f64::from(halved)).powi(2) - 1.0)
    }

    /// Solves the companion of level `number` for a motion with the trapezoid rule alone (where bounds fall with the slip, with the
    /// three-point rule first), started from the level's `answer`.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub(crate) fn solve(
        self,
        task: &RollingTask,
        state: &mut RefinementState,
        number: usize,
        answer: &LevelAnswer,
        asked: MotionTask,
        monitor: &dyn Monitor,
    ) -> Result<(CompanionAnswer, Work), SolveError> {
        let missing = (CompanionAnswer::Missing, Work::default());
        let Some(plan) = self.plan(state.levels.get(number).plan) else {
            return Ok(missing);
        };
        let companion = match state.levels.level(plan) {
            Ok(companion) => companion,
            // Half the strips may miss a patch.
            Err(SolveError::Unmeshable { .. }) => return Ok(missing),
            Err(error) => return Err(error),
        };
        let (fine, level) = (state.levels.get(number), state.levels.get(companion));
        let (levels, motion) = ([number, companion], level.scale.motion(&asked.motion));
        let nested = nested_tractions(&fine, &answer.traction, &level);
        let sweep = &mut state.sweep;
        let start = sweep.companion_start(levels, &motion, nested.clone(), &level.bound);
        let of_level = level_task(task, &level, &motion, asked.index);
        match boundary_element::trapezoid(of_level, &start, &mut state.workspace, monitor) {
            Ok((traction, work)) => {
                sweep.remember_companion(levels, motion, &nested, &traction);
                let patches = task.footprint.patches().len();
                let found = (0..patches)
                    .map(|p| Resultants::of_patch(&level, &traction, p))
                    .collect();
                let reach = self.reach(fine.plan.size, plan.size);
                Ok((CompanionAnswer::Found(found, reach), work))
            }
            Err(LevelFailure::NotConverged { work, .. }) => Ok((CompanionAnswer::Missing, work)),
            Err(LevelFailure::Stopped(stop)) => Err(stop.into()),
        }
    }
}
