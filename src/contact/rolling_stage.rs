//! The stage of the tangential problem: solves the motions of a problem on its footprint and adds them to the answer.

use std::sync::Arc;

use crate::case::words::solver::Output;
use crate::error::SolveError;
use crate::method::Method;
use crate::normal_stage::SolvedFootprint;
use crate::problem::checked_case::CheckedCase;
use crate::remark::list::Remark;
use crate::rolling::answer::{MotionAnswer, Skip};
use crate::rolling::methods::table::solve as table;
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::refinement::gradients::add_gradients;
use crate::rolling::refinement::interpolate::{Levels, RefinementState};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{RelativeTo, Resolution, RollingTask, TARGET_LEAST};
use crate::rolling::{force_control, history};
use crate::solution::assemble::Assembly;
use crate::solution::words::answer::{Fields, Solution};
use crate::time_limit::TimeLimit;

/// Receives the answer to each motion in order, with the mesh of its fields.
pub(crate) type AddMotion<'a> =
    dyn FnMut(MotionAnswer, Option<Arc<StripMesh>>) -> Result<(), SolveError> + 'a;

/// Solves all motions of a problem on a footprint.
///
/// # Errors
/// The reason why a motion has no answer, or the monitor stopped the work.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let mut assembly = Assembly::new(case, solved);
    let add = &mut |point: MotionAnswer, level: Option<Arc<StripMesh>>| {
        Ok(assembly.add(level.as_ref(), &point, watch)?)
    };
    solve_motions(operators, case, solved, watch, add)?;
    Ok(assembly.finish())
}

/// Solves all motions of a problem on a footprint and passes each answer to `add`.
///
/// # Errors
/// See [`solve`], or the error of `add`.
pub(crate) fn solve_motions(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    watch: &TimeLimit,
    add: &mut AddMotion,
) -> Result<(), SolveError> {
    // The time of the normal problem counts for the first motion.
    let mut normal_seconds = solved.report.map_or(0.0, |report| report.seconds);
    let add = &mut |levels: &Levels, mut point: MotionAnswer| {
        if solved.coupling_error > 0.0 {
            let errors = point.errors.iter_mut().flatten();
            errors.for_each(|error| *error = error.hypot(solved.coupling_error));
        }
        point.seconds += std::mem::take(&mut normal_seconds);
        let level = point.fields.as_ref().map(|fields| levels.get(fields.level));
        add(point, level)?;
        watch.advance();
        Ok(())
    };
    let ended = on_footprint(operators, case, solved, watch, add);
    ended.map_err(|error| watch.explained(error, case))
}

/// Receives the answer to a motion and the meshes of its refinement.
type AddAnswer<'a> = dyn FnMut(&Levels, MotionAnswer) -> Result<(), SolveError> + 'a;

fn on_footprint(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    watch: &TimeLimit,
    add: &mut AddAnswer,
) -> Result<(), SolveError> {
    let mut task = case.rolling_task(&solved.footprint);
    task.resolution = task.resolution.beside(solved.coupling_error);
    if let Some(reason) = task.falls_too_fast() {
        return Err(SolveError::NotCovered { reason });
    }
    let mut state = RefinementState::new(&task, operators);
    if let Some(history) = &case.problem.history {
        let patches = solved.footprint.patches().iter();
        let extents: Vec<[f64; 4]> = patches.map(|patch| patch.extent).collect();
        if let Some(reason) = history::solve::too_long(history, &extents, case.run.steps_max) {
            return Err(SolveError::NotCovered { reason });
        }
        let part = watch.of_next(case.problem.motions.len());
        let mut points = history::solve::solve(&task, history, &mut state, &part)?.into_iter();
        return points.try_for_each(|point| add(&state.levels, point));
    }
    for index in 0..case.problem.motions.len() {
        let by_table = by_table(case, &task, &state, index, watch)?;
        let point = match by_table.clone().filter(|_| !case.run.needs_cells()) {
            Some(found) => found,
            None => force_control::solve(&task, &mut state, index, watch)?,
        };
        let motion = StagedMotion {
            operators,
            case,
            coupling: solved.coupling_error,
            index,
            watch,
            by_table,
        };
        match case.run.relative_to {
            RelativeTo::FrictionLimit => motion.add(add, &task, &mut state, point)?,
            RelativeTo::Force => motion.add_to_force(add, &task, &mut state, point, 0)?,
        }
        state.trim();
    }
    Ok(())
}

/// Returns the answer of the creep table to a motion, if `auto` takes its resultants because its error bound meets the target. The resultants
/// then do not depend on whether a mesh is solved for values per cell.
fn by_table(
    case: &CheckedCase,
    task: &RollingTask,
    state: &RefinementState,
    index: usize,
    watch: &TimeLimit,
) -> Result<Option<MotionAnswer>, SolveError> {
    if !case.may_take_table(index) {
        return Ok(None);
    }
    let mut found = table::solve(task, state.ellipses(), &task.motions[index], watch)?;
    found.skips.push(Skip::Mesh);
    let limit = task.friction.limit_of_all(task.footprint);
    let allowed = case.run.allowed_error(&found, limit);
    let both = allowed.zip(found.error());
    let is_met = both.is_some_and(|(allowed, error)| error <= allowed);
    Ok(is_met.then_some(found))
}

/// Maximum number of repeated solves of a motion with smaller targets. The force hardly changes after the first solve.
const ROUNDS_MAX: u32 = 3;
/// Requested error relative to the allowed one. The force of the next solve may be smaller.
const AIMED: f64 = 0.9;

/// A motion that is added to the answer.
struct StagedMotion<'a> {
    operators: &'a Arc<OperatorStore>,
    case: &'a CheckedCase,
    /// The error of the pressures, see [`SolvedFootprint`].
    coupling: f64,
    index: usize,
    watch: &'a TimeLimit<'a>,
    /// The answer of the table, if it gives the resultants.
    by_table: Option<MotionAnswer>,
}

impl StagedMotion<'_> {
    /// Adds the motion to the answer.
    fn add(
        &self,
        add: &mut AddAnswer,
        task: &RollingTask,
        state: &mut RefinementState,
        mut point: MotionAnswer,
    ) -> Result<(), SolveError> {
        if let Some(found) = &self.by_table {
            point.take_resultants(found);
        }
        if self.case.run.wants(Output::Gradients) && point.gradients.is_none() {
            let predictor = state.predictor.clone();
            match add_gradients(task, state, self.index, &mut point, self.watch) {
                Err(SolveError::NotConverged { .. }) => {
                    point.remarks.push(Remark::GradientsNotConverged {});
                }
                other => other?,
            }
            // The next motion starts as it does without gradients.
            state.predictor = predictor;
        }
        add(&state.levels, point)
    }

    /// Adds the motion when its error is small enough relative to its force, or no target makes it smaller. The target of each round relative to
    /// μN follows from the force of the previous round.
    fn add_to_force(
        &self,
        add: &mut AddAnswer,
        task: &RollingTask,
        state: &mut RefinementState,
        point: MotionAnswer,
        round: u32,
    ) -> Result<(), SolveError> {
        if let Some(target) = self.smaller_target(task, &point)
            && round < ROUNDS_MAX
        {
            let finer = RollingTask {
                resolution: Resolution::Target(target),
                ..*task
            };
            let mut finer_state = RefinementState::new(&finer, self.operators);
            let found = force_control::solve(&finer, &mut finer_state, self.index, self.watch);
            match found {
                Ok(mut found) => {
                    found.seconds += point.seconds;
                    found.work.add_lost(point.work);
                    return self.add_to_force(add, &finer, &mut finer_state, found, round + 1);
                }
                // The answer of the previous round is used with its error.
                Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        self.add(add, task, state, point)
    }

    /// Returns the target relative to μN with which the error may be small enough; `None` if it is small enough or no smaller target helps.
    fn smaller_target(&self, task: &RollingTask, point: &MotionAnswer) -> Option<f64> {
        let asked = task
            .target()
            .filter(|_| task.method == Method::BoundaryElement)?;
        let limit = task.friction.limit_of_all(task.footprint);
        let allowed = self.case.run.allowed_error(point, limit)?;
        let error = point.error()?.hypot(self.coupling);
        let wanted = Resolution::Target((AIMED * allowed).max(TARGET_LEAST));
        let target = wanted.beside(self.coupling).target()?.max(TARGET_LEAST);
        (error > allowed && target < asked).then_some(target)
    }
}
