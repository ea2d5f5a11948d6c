//! One motion of a case, from the coarsest level to the finest, with an estimate of its error.

use crate::contact::error::SolveError;
use crate::contact::mesh::size::MeshSize;
use crate::contact::method::Method;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::{LevelExit, Work};
use crate::contact::rolling::mesh_plan::{MeshPlan, Regime};
use crate::contact::rolling::methods::table::solve as table;
use crate::contact::rolling::motion_answer::MotionAnswer;
use crate::contact::rolling::refinement::companion_answer::{self, CompanionAnswer};
use crate::contact::rolling::refinement::companions::Companion;
use crate::contact::rolling::refinement::constants::{
    CELLS_FINE, CELLS_SHOWN, EXTRAPOLATED, FINE_TARGET, MARGIN, SHOWN_TARGET,
};
use crate::contact::rolling::refinement::error_estimate::Indicators;
use crate::contact::rolling::refinement::level_solve::{
    JudgedAnswer, MotionTask, SolvedLevel, add_three_point, solve_level,
};
use crate::contact::rolling::refinement::mesh_policy::{HalfDoublings, MeshPolicy};
use crate::contact::rolling::refinement::regime::regime;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::resolution::Resolution;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// Explicit meshes of at least so many cells are started from a coarser mesh. On 24 ellipses of `benches/calibrate` with meshes of 720 to
/// 2464 cells, 500 and 2000 take 5 to 10 % more time, and no such start 24 % more.
pub(crate) const CELLS_NESTED: u64 = 1000;
/// Fewest strips, and cells in one, of that coarser mesh. 4 and 16 take as many products on these ellipses, to 1 %.
const SIDE_HALVED: u32 = 8;

/// Solves a motion, from the coarsest level up to the first that meets the target, each started from
/// the one before.
///
/// # Errors
/// Why there is no answer.
pub fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    state.sweep.path.clear();
    if task.method == Method::Table {
        return table::solve(task, state.ellipses(), &asked.motion, monitor);
    }
    let sizes = MeshPolicy::fixed_sizes(task.resolution, task.method);
    match (sizes, task.resolution) {
        (Some(sizes), _) => {
            let mut solved = solve_level(task, state, asked, sizes[0].into(), None, monitor)?;
            for size in &sizes[1..] {
                let below = Some(solved.point);
                solved = solve_level(task, state, asked, (*size).into(), below, monitor)?;
            }
            Ok(solved.point.into())
        }
        (None, Resolution::Mesh(size)) => {
            on_mesh(task, state, asked, size, monitor).map(MotionAnswer::from)
        }
        (None, Resolution::Target(target)) => {
            let mut solved = to_target(task, state, asked, target, monitor)?.answer.point;
            if task.wants_slips && solved.tangential.is_of_one_rule() {
                let same = [0, 1].map(|k| vec![0.0; solved.tangential.traction[k].len()]);
                add_three_point(task, state, &mut solved, asked, &same, monitor)?;
            }
            Ok(solved.into())
        }
    }
}

/// Solves a motion on a mesh given by the client; a large mesh is started from one of half as many strips and cells.
fn on_mesh(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    size: MeshSize,
    monitor: &dyn Monitor,
) -> Result<SolvedLevel, SolveError> {
    let cells = |size: MeshSize| u64::from(size.strips) * u64::from(size.cells);
    let mut coarser = None;
    let half = MeshSize {
        strips: (size.strips / 4 * 2).max(SIDE_HALVED),
        cells: (size.cells / 2).max(SIDE_HALVED),
    };
    let number = state.levels.level(size.into())?;
    let level = state.levels.get(number);
    let motion = level.scale.motion(&asked.motion);
    let started = state.sweep.start(number, &level, &motion).is_some();
    if !started && cells(size) >= CELLS_NESTED && 2 * cells(half) <= cells(size) {
        coarser = match on_mesh(task, state, asked, half, monitor) {
            Ok(point) => Some(point),
            // The mesh that was asked for may have an answer all the same.
            Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }) => None,
            Err(error) => return Err(error),
        };
    }
    solve_level(task, state, asked, size.into(), coarser, monitor).map(|solved| solved.point)
}

/// Solves a motion on given levels, one after the other, and judges it on the finest. Whether a companion that was tried has no answer,
/// so that the resultants are not extrapolated, is told beside it. Nothing if there are no levels.
///
/// # Errors
/// Why there is no answer.
pub fn on_levels(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    path: &[MeshPlan],
    monitor: &dyn Monitor,
) -> Result<Option<(MotionAnswer, bool)>, SolveError> {
    let Some(mut solved) = along_path(task, state, asked, path, monitor)? else {
        return Ok(None);
    };
    judge(task, state, asked, &mut solved, None, monitor)?;
    let missing = solved.indicators.companion_missing();
    Ok(Some((solved.point.into(), missing)))
}

/// Resultants of the tractions on the finest of given levels, without companions, and the work; the coarser levels are left out if the
/// last motion there is near. They are a function of the motion, to the residual.
///
/// # Errors
/// Why there is no answer.
pub fn sums_on_finest(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    path: &[MeshPlan],
    monitor: &dyn Monitor,
) -> Result<(Vec<Resultants>, Work), SolveError> {
    let Some(finest) = path.last() else {
        unreachable!("an answer that was judged stands on a level")
    };
    let number = state.levels.level(*finest)?;
    let level = state.levels.get(number);
    let motion = level.scale.motion(&asked.motion);
    let near = state.sweep.start(number, &level, &motion).is_some();
    let path = if near {
        std::slice::from_ref(finest)
    } else {
        path
    };
    match along_path(task, state, asked, path, monitor)? {
        Some(solved) => Ok((solved.point.summed, solved.point.work)),
        None => unreachable!("the path has levels"),
    }
}

/// Solves a motion on given levels, each started from the one before.
fn along_path(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    path: &[MeshPlan],
    monitor: &dyn Monitor,
) -> Result<Option<JudgedAnswer>, SolveError> {
    state.sweep.path.clear();
    let mut solved: Option<JudgedAnswer> = None;
    for plan in path {
        let below = solved.map(|solved| solved.point);
        solved = Some(solve_level(task, state, asked, *plan, below, monitor)?);
    }
    Ok(solved)
}

/// Solves a motion from the coarsest mesh, or where the last motion of a sweep ended, up to the first mesh that meets the target.
///
/// A mesh whose own indicators exceed the target is refused at once. Only one that passes is solved again on its companions, first on
/// half the strips, then on half the cells.
///
/// # Errors
/// Why there is no answer.
pub(crate) fn to_target(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    target: f64,
    monitor: &dyn Monitor,
) -> Result<ComparedAnswer, SolveError> {
    let follows = match state.sweep.begin {
        Some(plan) => {
            let number = state.levels.level(plan)?;
            let level = state.levels.get(number);
            let motion = level.scale.motion(&asked.motion);
            state.sweep.follows(number, &motion)
        }
        None => false,
    };
    let begin = state.sweep.begin.take().filter(|_| follows);
    let begun = match begin.or(state.sweep.begin_head) {
        Some(plan) => begin_on(task, state, asked, plan, monitor)?,
        None => None,
    };
    let solved = match begun {
        Some(solved) => solved,
        None => {
            let first = state.policy.first();
            solve_level(task, state, asked, first, None, monitor)?
        }
    };
    let cells = state.levels.get(solved.point.level).mesh.cells();
    let larger = state.policy.is_refinable(cells, HalfDoublings::NONE);
    let mut found = ComparedAnswer::untried(solved);
    if !(is_small(cells, target) && larger) {
        let target = larger.then_some(target);
        found.companions = judge(task, state, asked, &mut found.answer, target, monitor)?;
    }
    let found = refined(task, state, asked, target, found, monitor)?;
    let begin = state
        .sweep
        .begin
        .filter(|_| !follows && !task.single_motion);
    if let Some(begin) = begin {
        state.sweep.remember_head(found.answer.point.level, begin);
    }
    Ok(found)
}

/// Is a mesh of so many cells not to be trusted with a target?
fn is_small(cells: usize, target: f64) -> bool {
    target < FINE_TARGET && cells < CELLS_FINE
}

/// Is an answer whose error the table may tell one that is looked at: a motion by itself, with zones, at a target that asks for more than
/// a sketch?
fn is_shown(
    task: &RollingTask,
    state: &RefinementState,
    solved: &JudgedAnswer,
    target: f64,
) -> bool {
    let answer = &solved.point.tangential;
    let zones = answer.exit == LevelExit::Solved && answer.slips.iter().any(|slips| !slips);
    task.single_motion && target <= SHOWN_TARGET && state.covered.is_some() && zones
}

/// Solves on from an answer that was compared with its companions, or is on too small a mesh for that, up to the first mesh that meets the
/// target.
///
/// # Errors
/// Why there is no answer.
pub(crate) fn refined(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    target: f64,
    mut found: ComparedAnswer,
    monitor: &dyn Monitor,
) -> Result<ComparedAnswer, SolveError> {
    let mut planned = HalfDoublings::NONE;
    loop {
        let margin = companion_answer::margin(task, &found.companions);
        let solved = found.answer;
        let cells = state.levels.get(solved.point.level).mesh.cells();
        let larger = state.policy.is_refinable(cells, planned);
        let met = solved.point.error().is_some_and(|error| error <= target);
        let shown = match is_shown(task, state, &solved, target) {
            true => CELLS_SHOWN,
            false => 0,
        };
        if !larger || met && !is_small(cells, target) && cells >= shown {
            found.answer = solved;
            break;
        }
        let excess = solved.point.error().map_or(1.0, |error| error / target);
        let excess = (margin * excess).max(shown as f64 / cells as f64);
        let regime = regime_of(state, asked, &solved.point);
        let plan;
        (plan, planned) = state
            .policy
            .next(cells, planned, excess, regime, task.single_motion);
        let below = Some(solved.point);
        found = ComparedAnswer::untried(solve_level(task, state, asked, plan, below, monitor)?);
        let cells = state.levels.get(found.answer.point.level).mesh.cells();
        let larger = state.policy.is_refinable(cells, planned);
        if !(is_small(cells, target) && larger) {
            let target = larger.then_some(target);
            found.companions = judge(task, state, asked, &mut found.answer, target, monitor)?;
        }
    }
    state.sweep.begin = Some(next_begin(state, &found.answer, target));
    Ok(found)
}

/// Where the motion after this one should begin.
pub(crate) fn next_begin(
    state: &mut RefinementState,
    solved: &JudgedAnswer,
    target: f64,
) -> MeshPlan {
    let level = state.levels.get(solved.point.level);
    let cells = level.mesh.cells();
    if let Some(error) = solved.indicators.by_table_on_half() {
        let enough = state.sweep.is_coarser_enough(error <= MARGIN * target);
        return state.policy.coarser_if(enough, level.plan, cells);
    }
    let excess = solved.point.error().map(|error| error / target);
    state.policy.next_begin(level.plan, cells, excess)
}

/// An answer, and those on the companions of its mesh.
#[derive(Debug, Clone)]
pub(crate) struct ComparedAnswer {
    /// The answer.
    pub(crate) answer: JudgedAnswer,
    /// Half the strips, half the cells.
    pub(crate) companions: [CompanionAnswer; 2],
}

impl ComparedAnswer {
    /// Does its estimate meet a target?
    pub(crate) fn met(&self, target: f64) -> bool {
        self.answer
            .point
            .error()
            .is_some_and(|error| error <= target)
    }

    fn untried(answer: JudgedAnswer) -> ComparedAnswer {
        ComparedAnswer {
            answer,
            companions: [CompanionAnswer::Untried, CompanionAnswer::Untried],
        }
    }
}

/// Solves the companions of a level and adds what they tell of value and error. With a target it stops as soon as the estimate exceeds
/// it.
///
/// # Errors
/// Why there is no answer.
pub(crate) fn judge(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    solved: &mut JudgedAnswer,
    target: Option<f64>,
    monitor: &dyn Monitor,
) -> Result<[CompanionAnswer; 2], SolveError> {
    let mut seen = [CompanionAnswer::Untried, CompanionAnswer::Untried];
    if !matches!(solved.indicators, Indicators::Measured(_)) {
        return Ok(seen);
    }
    let began = monitor.elapsed();
    let point = &mut solved.point;
    for (k, which) in [Companion::Across, Companion::Along]
        .into_iter()
        .enumerate()
    {
        if target.is_some_and(|target| point.error().is_none_or(|error| error > target)) {
            break;
        }
        let (found, work) =
            which.solve(task, state, point.level, &point.tangential, asked, monitor)?;
        solved.indicators.see(task, k, &point.summed, &found);
        seen[k] = found;
        point.work.add(Work {
            residual: point.work.residual,
            ..work
        });
        point.errors = solved.indicators.errors();
    }
    extrapolate(task, state, solved, &seen);
    solved.point.seconds += (monitor.elapsed() - began).as_secs_f64();
    Ok(seen)
}

/// Extrapolates the resultants by what both companions tell, except where cells gather about a pole.
pub(crate) fn extrapolate(
    task: &RollingTask,
    state: &RefinementState,
    solved: &mut JudgedAnswer,
    seen: &[CompanionAnswer; 2],
) {
    let point = &mut solved.point;
    if let [
        CompanionAnswer::Found(across, strips),
        CompanionAnswer::Found(along, cells),
    ] = seen
        && state.levels.get(point.level).plan.pole().is_none()
    {
        for p in 0..task.footprint.patches().len() {
            let limit = task.friction.limit(task.footprint, p);
            let bound = match task.friction.across() {
                // The loads of the strips are not quite those of the limit.
                Some(_) => {
                    let sum = point.summed[p];
                    limit.max(sum.force_x.hypot(sum.force_y))
                }
                None => limit,
            };
            let companions = [(across[p], strips), (along[p], cells)];
            let companions = companions.map(|(other, reach)| (other, EXTRAPOLATED * reach));
            point.resultants[p] = point.summed[p].beyond_all(companions, bound);
        }
        // The tractions that a client may sum are no further from the resultants than the estimate says.
        solved
            .indicators
            .apart(task, &point.resultants, &point.summed);
        point.errors = solved.indicators.errors();
        for (k, error) in point.errors.iter().take(point.summed.len()).enumerate() {
            // Where nothing tells the error, nothing tells whether to go beyond the tractions.
            if error.is_none() {
                point.resultants[k] = point.summed[k];
            }
        }
    }
}

/// Begins a motion of a sweep on the mesh where the last motion ended, if that serves this one too.
fn begin_on(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    plan: MeshPlan,
    monitor: &dyn Monitor,
) -> Result<Option<JudgedAnswer>, SolveError> {
    if plan.regime == Regime::Unknown {
        return Ok(None);
    }
    let number = state.levels.level(plan)?;
    let level = state.levels.get(number);
    let motion = level.scale.motion(&asked.motion);
    if state.sweep.start(number, &level, &motion).is_none() && !state.carry(number, &asked.motion) {
        return Ok(None);
    }
    let solved = solve_level(task, state, asked, plan, None, monitor)?;
    if solved.indicators.is_by_table() {
        return Ok(Some(solved));
    }
    let found = regime_of(state, asked, &solved.point);
    if plan.serves(found) {
        return Ok(Some(solved));
    }
    // Its tractions are still a good start for a mesh that does serve.
    state.sweep.path.clear();
    let cells = state.levels.get(number).mesh.cells() as u32;
    let plan = state.policy.plan(cells, found);
    solve_level(task, state, asked, plan, Some(solved.point), monitor).map(Some)
}

/// What the tractions of a solved level look like.
pub(crate) fn regime_of(state: &RefinementState, asked: MotionTask, point: &SolvedLevel) -> Regime {
    let spinning = asked.motion.spin_per_mm != 0.0;
    regime(&state.levels.get(point.level), &point.tangential, spinning)
}
