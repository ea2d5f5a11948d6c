//! The adaptive solve of one motion on its family of meshes.

use crate::error::SolveError;
use crate::mesh::MeshSize;
use crate::method::Method;
use crate::monitor::Monitor;
use crate::numerics::roots::ROUNDING;
use crate::rolling::answer::{MotionAnswer, SolvedFields, Work};
use crate::rolling::methods::table::solve as table;
use crate::rolling::refinement::error_estimate::{Estimate, coarser};
use crate::rolling::refinement::interpolate::RefinementState;
use crate::rolling::refinement::mesh_family::{MeshFamily, fixed_meshes};
use crate::rolling::refinement::on_mesh::{
    DiscreteSolution, MotionTask, add_smooth_slips, solve_on_mesh,
};
use crate::rolling::task::{MeshPlan, RollingTask};

/// If the estimate exceeds the target by at most this part of it, the next mesh has √2 times as many cells, and the solution is a mean of both meshes. So
/// the solutions of neighbouring motions do not jump where the number of meshes changes.
const BLENDED: f64 = 0.5;

/// Solves a motion by the method of the task.
///
/// # Errors
/// The reason why there is no solution.
pub fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    let mut found = solve_forces(task, state, asked, monitor)?.0;
    add_slips(task, state, asked.index, &mut found, monitor)?;
    Ok(found)
}

/// Solves a motion without smooth slips. Also returns the meshes that the estimate compares.
pub(crate) fn solve_forces(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    monitor: &dyn Monitor,
) -> Result<(MotionAnswer, Vec<MeshPlan>), SolveError> {
    if task.method == Method::Table {
        let found = table::solve(task, state.ellipses(), &asked.motion, monitor)?;
        return Ok((found, Vec::new()));
    }
    let mut run = AdaptiveRun::new(task, state, asked, monitor);
    let estimate = match (fixed_meshes(task.resolution, task.method), task.target()) {
        (None, Some(target)) => run.meet_target(target)?,
        (sizes, _) => {
            let sizes = sizes.unwrap_or_default();
            require_steady(task, asked.index, sizes.last())?;
            let plans: Vec<MeshPlan> = sizes.into_iter().map(MeshPlan::from).collect();
            run.on_meshes(&plans, false)?
        }
    };
    let plans = run.compared();
    Ok((run.finish(estimate), plans))
}

/// Refuses a mesh with more cells in a strip than the motion allows; see [`RollingTask::cells_along_max`].
fn require_steady(
    task: &RollingTask,
    index: usize,
    finest: Option<&MeshSize>,
) -> Result<(), SolveError> {
    let most = task.cells_along_max(index);
    match finest {
        Some(finest) if f64::from(finest.cells) > most => Err(SolveError::NotCovered {
            reason: format!(
                "`mesh` has {} cells in a strip; because friction falls with slip and the layer is soft, stick and slip alternate from cell to cell \
                 with more than {most:.1}",
                finest.cells
            ),
        }),
        _ => Ok(()),
    }
}

/// Solves a motion on given meshes, coarse to fine. Value and estimate are smooth functions of the motion.
///
/// # Errors
/// The reason why there is no solution.
pub(crate) fn solve_on_meshes(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    plans: &[MeshPlan],
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    let mut run = AdaptiveRun::new(task, state, asked, monitor);
    let estimate = run.on_meshes(plans, true)?;
    Ok(run.finish(estimate))
}

/// Adds smooth slips to a solution if they are requested. Forces do not depend on it.
///
/// # Errors
/// The monitor may stop the work.
pub(crate) fn add_slips(
    task: &RollingTask,
    state: &mut RefinementState,
    index: usize,
    found: &mut MotionAnswer,
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    if !task.wants_slips {
        return Ok(());
    }
    let motion = found.motion;
    let asked = MotionTask { index, motion };
    if let Some(SolvedFields { level, tangential }) = &mut found.fields {
        let work = add_smooth_slips(task, state, asked, *level, tangential, monitor)?;
        found.work.add_lost(work);
    }
    Ok(())
}

/// The state of the solve of one motion.
struct AdaptiveRun<'a, 's, 't> {
    task: &'a RollingTask<'a>,
    state: &'s mut RefinementState<'t>,
    asked: MotionTask,
    monitor: &'a dyn Monitor,
    began: f64,
    /// The solved meshes, coarse to fine.
    solved: Vec<DiscreteSolution>,
    /// Whether the previous mesh has no solution.
    failed: bool,
    work: Work,
}

impl<'a, 's, 't> AdaptiveRun<'a, 's, 't> {
    fn new(
        task: &'a RollingTask<'a>,
        state: &'s mut RefinementState<'t>,
        asked: MotionTask,
        monitor: &'a dyn Monitor,
    ) -> AdaptiveRun<'a, 's, 't> {
        AdaptiveRun {
            task,
            state,
            asked,
            monitor,
            began: monitor.elapsed().as_secs_f64(),
            solved: Vec::new(),
            failed: false,
            work: Work::default(),
        }
    }

    /// Solves the meshes of the family until the estimate meets the target or the finest mesh is reached.
    fn meet_target(&mut self, target: f64) -> Result<Estimate, SolveError> {
        let along = self.task.cells_along_max(self.asked.index);
        let family = MeshFamily::of(self.task, &self.asked.motion).with_cells_along(along);
        let most = family.cells_max();
        let mut cells = family.cells_first();
        let mut before: Option<Estimate> = None;
        loop {
            let is_finest = cells > 0.999 * most;
            let is_needed = is_finest && self.solved.is_empty();
            self.add(family.mesh(cells), is_needed)?;
            let mut times = 2.0_f64;
            let estimate = Estimate::of(self.task, self.asked.index, &self.solved, true);
            let is_judged = self.compared().len() > 2;
            if let Some(mut found) = estimate.filter(|_| is_judged || is_finest) {
                let error = found.whole().unwrap_or(f64::INFINITY);
                if error <= target || is_finest {
                    if let Some(before) = &before {
                        found.blend(before, target);
                        // The estimate also covers the distance from the sums of the tractions, which a client may compute.
                        let finest = self.solved.last();
                        found.cover(self.task, finest.map_or(&[], |mesh| &mesh.resultants));
                    }
                    return Ok(found);
                }
                if error < (1.0 + BLENDED) * target {
                    times = times.sqrt();
                }
                before = Some(found);
            }
            cells = (times * cells).min(most);
        }
    }

    /// Solves given meshes, of which only the finest needs a solution.
    fn on_meshes(
        &mut self,
        plans: &[MeshPlan],
        extrapolates: bool,
    ) -> Result<Estimate, SolveError> {
        for (k, plan) in plans.iter().enumerate() {
            self.add(*plan, k + 1 == plans.len())?;
        }
        let found = Estimate::of(self.task, self.asked.index, &self.solved, extrapolates);
        let Some(found) = found else {
            unreachable!("the finest mesh has an answer")
        };
        Ok(found)
    }

    /// Solves a mesh unless it was the last one. A mesh that is not needed may have no solution, but not two in a row.
    fn add(&mut self, plan: MeshPlan, is_needed: bool) -> Result<(), SolveError> {
        let last = self.solved.last();
        if last.is_some_and(|last| last.mesh.plan == plan) {
            return Ok(());
        }
        let found = solve_on_mesh(self.task, self.state, self.asked, plan, last, self.monitor);
        match found {
            Ok(found) => {
                self.work.add(found.tangential.work);
                self.solved.push(found);
                self.failed = false;
            }
            Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. })
                if !is_needed && !self.failed =>
            {
                self.failed = true;
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// The meshes that the estimate compares, coarse to fine: the finest and up to two coarser ones.
    fn compared(&self) -> Vec<MeshPlan> {
        let last = self.solved.len().checked_sub(1);
        let next = |k: &usize| coarser(&self.solved, *k);
        let chain = std::iter::successors(last, next).take(3);
        let mut plans: Vec<MeshPlan> = chain.map(|k| self.solved[k].mesh.plan).collect();
        plans.reverse();
        plans
    }

    fn finish(mut self, estimate: Estimate) -> MotionAnswer {
        let Some(DiscreteSolution {
            number,
            mut tangential,
            ..
        }) = self.solved.pop()
        else {
            unreachable!("an estimate belongs to a mesh")
        };
        MotionAnswer {
            motion: self.asked.motion,
            resultants: estimate.resultants,
            errors: estimate.errors,
            skips: tangential.skip.into_iter().collect(),
            remarks: std::mem::take(&mut tangential.remarks),
            fields: Some(SolvedFields {
                level: number,
                tangential,
            }),
            work: self.work,
            method: self.task.method,
            seconds: self.monitor.elapsed().as_secs_f64() - self.began,
            ..MotionAnswer::default()
        }
    }
}

impl Estimate {
    /// Moves value and errors towards those of the previous mesh; the closer its estimate was to the target, the farther.
    fn blend(&mut self, before: &Estimate, target: f64) {
        let excess = before
            .whole()
            .map_or(f64::INFINITY, |error| error / target - 1.0);
        let weight = (excess / BLENDED).clamp(0.0, 1.0);
        if weight == 1.0 {
            return;
        }
        for (value, other) in self.resultants.iter_mut().zip(&before.resultants) {
            *value = value.times(weight).plus(other.times(1.0 - weight));
        }
        for (error, other) in self.errors.iter_mut().zip(&before.errors) {
            if let (Some(error), Some(other)) = (error, other) {
                let mixed = weight * *error + (1.0 - weight) * other;
                let met = *error <= target;
                // If the finer mesh meets the target, so does the mean, with room for rounding.
                let most = if met {
                    (1.0 - ROUNDING) * target
                } else {
                    mixed
                };
                *error = error.max(mixed.min(most));
            }
        }
    }
}
