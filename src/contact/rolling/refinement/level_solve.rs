//! One motion on one level: start, method, indicators.

use crate::contact::error::SolveError;
use crate::contact::mesh::size::MeshSize;
use crate::contact::method::Method;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::{LevelAnswer, LevelExit, LevelFailure, Work};
use crate::contact::rolling::mesh_plan::MeshPlan;
use crate::contact::rolling::methods::boundary_element::solve as boundary_element;
use crate::contact::rolling::methods::boundary_element::task::LevelTask;
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::methods::liu_hsu::on_level;
use crate::contact::rolling::methods::{fastsim, full_slip};
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::motion_answer::{MotionAnswer, RelativeErrors, SolvedFields};
use crate::contact::rolling::refinement::constants::{LEVEL_RATIO_MIN, SHOWN_TARGET};
use crate::contact::rolling::refinement::error_estimate;
use crate::contact::rolling::refinement::error_estimate::Indicators;
use crate::contact::rolling::refinement::estimate_context::{CoarserLevel, EstimateContext};
use crate::contact::rolling::refinement::one_rule;
use crate::contact::rolling::refinement::slender::slender;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::refinement::warm_start::{from_coarser, simplified};
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::skip::Skip;
use crate::contact::rolling::start::Start;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// The coarse mesh on which the method of Liu and Hsu finds its spin pole; they recommend fewer than 30 cells (see `liu_hsu`).
const POLE_MESH: MeshSize = MeshSize {
    strips: 5,
    cells: 5,
};

/// A motion of a problem, and the creepages it is solved with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTask {
    /// The number of the motion.
    pub index: usize,
    /// Creepages and spin.
    pub motion: Motion,
}

/// The answer for one motion on one level.
#[derive(Debug, Clone)]
pub struct SolvedLevel {
    /// The motion it was solved for.
    pub motion: Motion,
    /// Tractions, slips and zones.
    pub tangential: LevelAnswer,
    /// The number of the level in the levels.
    pub level: usize,
    /// Resultants of every patch about the origin of the case: the best known.
    pub resultants: Vec<Resultants>,
    /// The same as the tractions give them, without extrapolation.
    pub summed: Vec<Resultants>,
    /// Difference of the two rules as an indicator, or what is left of it from a coarser level: it falls as 1/N.
    pub rules: Option<Vec<f64>>,
    /// Estimated errors, see [`Indicators::errors`].
    pub errors: RelativeErrors,
    /// Work over all levels.
    pub work: Work,
    /// The method that was used.
    pub method: Method,
    /// Wall time in s.
    pub seconds: f64,
}

impl SolvedLevel {
    /// Estimated error of the sum over the patches.
    #[must_use]
    pub fn error(&self) -> Option<f64> {
        self.errors.last().copied().flatten()
    }
}

impl From<SolvedLevel> for MotionAnswer {
    fn from(solved: SolvedLevel) -> MotionAnswer {
        let mut tangential = solved.tangential;
        MotionAnswer {
            motion: solved.motion,
            saturated: false,
            resultants: solved.resultants,
            errors: solved.errors,
            skips: std::mem::take(&mut tangential.skips),
            remarks: std::mem::take(&mut tangential.remarks),
            fields: Some(SolvedFields {
                level: solved.level,
                tangential,
            }),
            table: None,
            history: None,
            work: solved.work,
            method: solved.method,
            seconds: solved.seconds,
        }
    }
}

/// An answer with the indicators of its error.
#[derive(Debug, Clone)]
pub struct JudgedAnswer {
    /// The answer.
    pub point: SolvedLevel,
    /// The indicators of its level.
    pub indicators: Indicators,
}

/// Solves a motion on one level, started from the answer on a coarser one if there is one. The estimates are those without companions
/// (see `judge` in `refine.rs`).
///
/// # Errors
/// Why there is no answer.
pub fn solve_level(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    plan: MeshPlan,
    coarser: Option<SolvedLevel>,
    monitor: &dyn Monitor,
) -> Result<JudgedAnswer, SolveError> {
    let began = monitor.elapsed();
    let number = state.levels.level(plan)?;
    let level = state.levels.get(number);
    let below = coarser
        .as_ref()
        .map(|point| (state.levels.get(point.level), &point.tangential));
    let motion = level.scale.motion(&asked.motion);
    // The motion before on this mesh is preferred: its tractions need not be interpolated from other cells.
    let warm = state.sweep.start(number, &level, &motion);
    // A part of a sweep counts from its own first motion, the client from that of the case.
    let named = |failure| named(failure, task, task.first_motion + asked.index);
    let workspace = &mut state.workspace;
    let told = coarser.as_ref().is_some_and(|point| point.rules.is_some());
    let (alone, lost) = match &below {
        Some((coarse, answer)) if warm.is_none() && told => {
            let of_level = level_task(task, &level, &motion, asked.index);
            let below = (coarse.as_ref(), *answer);
            one_rule::attempt(task, of_level, below, workspace, monitor).map_err(named)?
        }
        _ => (None, Work::default()),
    };
    let tangential = match alone {
        Some(found) => found,
        None => {
            let nested = |(coarse, answer)| from_coarser(coarse, answer, &level);
            let below = below
                .as_ref()
                .map(|(coarse, answer)| (coarse.as_ref(), *answer));
            let start = warm.or_else(|| below.map(nested));
            let found = run_method(task, &level, asked, start, workspace, monitor);
            let mut found = found.map_err(named)?;
            found.work.add_lost(lost);
            found
        }
    };
    // A motion by itself leaves nothing to another one, but a search for creepages solves its later trials on the same levels.
    if !task.single_motion || task.has_prescribed_forces() {
        state.sweep.remember(number, motion, &tangential);
    }
    state.sweep.path.push(number);
    let mut work = coarser.as_ref().map_or(Work::default(), |point| point.work);
    work.add(tangential.work);
    let mut solved = answer_on(task, state, number, asked, tangential, coarser.as_ref());
    solved.point.work = work;
    solved.point.seconds =
        (monitor.elapsed() - began).as_secs_f64() + coarser.map_or(0.0, |point| point.seconds);
    Ok(solved)
}

/// What is known of a motion from an answer on a level, and from that on a coarser one if there is one.
pub(crate) fn answer_on(
    task: &RollingTask,
    state: &RefinementState,
    number: usize,
    asked: MotionTask,
    tangential: LevelAnswer,
    coarser: Option<&SolvedLevel>,
) -> JudgedAnswer {
    let level = state.levels.get(number);
    let patches = task.footprint.patches().len();
    let summed: Vec<Resultants> = (0..patches)
        .map(|p| Resultants::of_patch(&level, &tangential.traction, p))
        .collect();
    let mut point = SolvedLevel {
        motion: asked.motion,
        work: tangential.work,
        tangential,
        level: number,
        // Extrapolated later, if both companions are solved.
        resultants: summed.clone(),
        summed,
        rules: coarser.and_then(|coarser| carried(state, &level, coarser)),
        errors: Vec::new(),
        method: method_used(task),
        seconds: 0.0,
    };
    let before = coarser.and_then(|coarser| before(state, &level, coarser));
    let indicators = indicators_on(task, state, &level, &point, before);
    point.rules = indicators.rules().cloned();
    point.errors = indicators.errors();
    if indicators.is_by_table() {
        point.tangential.skips.push(Skip::CompanionsByTable);
    }
    JudgedAnswer { point, indicators }
}

/// Indicators of an answer on a level.
pub(crate) fn indicators_on(
    task: &RollingTask,
    state: &RefinementState,
    level: &StripMesh,
    point: &SolvedLevel,
    before: Option<CoarserLevel>,
) -> Indicators {
    let covered = state.covered.as_ref();
    let covered = covered.filter(|_| point.tangential.exit == LevelExit::Solved);
    let table = covered.map(|covered| covered.answer(&point.motion));
    let table = table.map(|table| (table, table.error(task, &point.summed)));
    if let Some((table, error)) = table.filter(|(_, error)| settles(task, *error)) {
        // Only a mesh that is refined all the same has a use for the rules.
        let refined = task.target().is_some_and(|target| target <= SHOWN_TARGET);
        let (answer, carried) = (&point.tangential, point.rules.as_deref());
        let rules = || error_estimate::between_rules(task, level, answer, &point.summed, carried);
        let rules = if refined { rules() } else { None };
        return Indicators::ByTable {
            table,
            error,
            rules,
        };
    }
    let finer = finer_for_sums(task, level, &point.motion, &point.tangential);
    let context = EstimateContext {
        motion: &point.motion,
        before,
        carried: point.rules.as_deref(),
        finer: finer.as_ref(),
        slenderness: state.policy.slenderness(),
        tolerance: task.tolerance(),
        table,
    };
    Indicators::of_level(task, level, &point.tangential, &point.summed, context)
}

/// Is an error by the table enough? A search for creepages needs resultants that are a continuous function of them, so that it compares
/// all its motions with the same meshes.
fn settles(task: &RollingTask, error: f64) -> bool {
    !task.has_prescribed_forces() && task.target().is_some_and(|target| error <= target)
}

/// The task of a motion on a level.
pub(crate) fn level_task<'a>(
    task: &'a RollingTask,
    level: &'a StripMesh,
    motion: &'a Motion,
    index: usize,
) -> LevelTask<'a> {
    LevelTask {
        level,
        motion,
        fall: task.bound_fall(index, level.scale.slip()),
        passage: task.passage(index).map(|laws| level.scale.passage(&laws)),
        tolerance: task.tolerance(),
    }
}

/// What is left of the difference of the rules on a coarser level.
fn carried(state: &RefinementState, level: &StripMesh, coarser: &SolvedLevel) -> Option<Vec<f64>> {
    let cells = state.levels.get(coarser.level).mesh.cells();
    let left = (cells as f64 / level.mesh.cells() as f64).min(1.0);
    let rules = coarser.rules.as_ref()?.iter();
    Some(rules.map(|rules| left * rules).collect())
}

/// The level before, if it is coarse enough to compare with.
pub(crate) fn before<'a>(
    state: &RefinementState,
    level: &StripMesh,
    point: &'a SolvedLevel,
) -> Option<CoarserLevel<'a>> {
    let below = state.levels.get(point.level);
    let ratio = level.mesh.cells() as f64 / below.mesh.cells() as f64;
    (ratio >= LEVEL_RATIO_MIN).then(|| CoarserLevel {
        summed: &point.summed,
        regime: below.plan.regime,
        share: 1.0 / (ratio - 1.0),
    })
}

/// A level of four times as many cells for the error of sums over cells: where the pressure jumps, and where everything slips under spin unless
/// an integral of the pressures is as exact.
fn finer_for_sums(
    task: &RollingTask,
    level: &StripMesh,
    motion: &Motion,
    answer: &LevelAnswer,
) -> Option<StripMesh> {
    let is_smooth = task.footprint.surprise().is_none() && task.friction.across().is_none();
    let patches = task.footprint.patches().len();
    let by_integral = is_smooth && level.mesh.cells() <= patches * full_slip::CELLS_MAX;
    let slides = !by_integral && error_estimate::turns_sliding(task, motion, answer);
    if !slides && !error_estimate::jumps(task) {
        return None;
    }
    let [strips, cells] = [level.plan.size.strips, level.plan.size.cells].map(|n| 2 * n);
    let size = MeshSize { strips, cells };
    StripMesh::new(task, MeshPlan { size, ..level.plan }).ok()
}

/// The method that solved; the reader of cases has resolved `auto`.
fn method_used(task: &RollingTask) -> Method {
    task.method
}

/// Adds the three-point rule, whose slips are smooth, to an answer of one rule, from tractions that differ from its own by `apart`. Where it
/// has no answer, slips stay those of the one rule.
///
/// # Errors
/// The monitor may stop the work.
pub(crate) fn add_three_point(
    task: &RollingTask,
    state: &mut RefinementState,
    solved: &mut SolvedLevel,
    asked: MotionTask,
    apart: &[Vec<f64>; 2],
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    let level = state.levels.used(solved.level);
    let motion = level.scale.motion(&asked.motion);
    let of_level = level_task(task, &level, &motion, asked.index);
    let (workspace, answer) = (&mut state.workspace, &mut solved.tangential);
    let before = answer.work;
    let added = boundary_element::three_point_beside(of_level, answer, apart, workspace, monitor);
    match added {
        Ok(()) | Err(LevelFailure::NotConverged { .. }) => {}
        Err(LevelFailure::Stopped(stop)) => return Err(stop.into()),
    }
    solved.work.add_lost(answer.work.since(before));
    Ok(())
}

pub(crate) fn named(failure: LevelFailure, task: &RollingTask, point: usize) -> SolveError {
    match failure {
        LevelFailure::Stopped(stop) => stop.into(),
        LevelFailure::NotConverged {
            work,
            tolerance,
            advice,
        } => SolveError::NotConverged {
            method: method_used(task),
            point,
            iterations: work.iterations as usize,
            residual: work.residual,
            tolerance,
            advice: match slender(task) {
                Some(slender) => format!("{slender}; {advice}"),
                None => advice,
            },
        },
    }
}

fn run_method(
    task: &RollingTask,
    level: &StripMesh,
    asked: MotionTask,
    start: Option<Start>,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    let motion = &asked.motion;
    // Tractions are 0, whatever the method.
    if task.friction.is_frictionless() {
        return Ok(full_slip::frictionless_answer(level, motion));
    }
    if task.method == Method::LiuHsu {
        let coarse = StripMesh::new(task, POLE_MESH).ok();
        return on_level::solve(level, coarse.as_ref(), motion, task.tolerance(), monitor);
    }
    let motion = level.scale.motion(motion);
    if task.method == Method::Fastsim {
        return Ok(fastsim::solve(task, level, &motion));
    }
    let of_level = level_task(task, level, &motion, asked.index);
    let start = start.or_else(|| simplified(task, of_level));
    boundary_element::solve(of_level, start.as_ref(), workspace, monitor)
}
