//! One motion on one mesh: start, method and resultants.

use std::sync::Arc;

use crate::error::SolveError;
use crate::mesh::MeshSize;
use crate::method::Method;
use crate::monitor::Monitor;
use crate::normal::hertz::Patch;
use crate::remark::kind::short;
use crate::rolling::answer::{LevelAnswer, LevelFailure, Resultants, Skip, Work};
use crate::rolling::methods::boundary_element::solve as boundary_element;
use crate::rolling::methods::boundary_element::task::LevelTask;
use crate::rolling::methods::fastsim;
use crate::rolling::methods::liu_hsu::on_level;
use crate::rolling::refinement::interpolate::{RefinementState, prolonged};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{MeshPlan, Motion, RollingTask};

/// The coarse mesh on which the method of Liu and Hsu finds its spin pole. They recommend fewer than 30 cells (see `liu_hsu`).
const POLE_MESH: MeshSize = MeshSize {
    strips: 5,
    cells: 5,
};
/// If a solve does not converge, a patch with a larger ratio of length along rolling to width is named as the likely reason. Most such patches converge.
const SLENDER: f64 = 20.0;

/// A motion of a problem with its creepages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTask {
    /// The number of the motion.
    pub index: usize,
    /// Creepages and spin.
    pub motion: Motion,
}

/// The solution for one motion on one mesh.
#[derive(Debug, Clone)]
pub struct DiscreteSolution {
    /// Number of the mesh.
    pub number: usize,
    /// The mesh.
    pub mesh: Arc<StripMesh>,
    /// Tractions, slips and zones.
    pub tangential: LevelAnswer,
    /// Resultants of the tractions of every patch about the origin of the case.
    pub resultants: Vec<Resultants>,
}

impl DiscreteSolution {
    /// The number of cells.
    pub fn cells(&self) -> f64 {
        self.mesh.mesh.cells() as f64
    }
}

/// Solves a motion on one mesh. The first iterate is predicted from earlier motions, or else prolonged from a coarser mesh, or else that of the simplified
/// theory.
///
/// # Errors
/// The reason why there is no solution.
pub fn solve_on_mesh(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    plan: MeshPlan,
    coarser: Option<&DiscreteSolution>,
    monitor: &dyn Monitor,
) -> Result<DiscreteSolution, SolveError> {
    let number = state.levels.level(plan)?;
    let mesh = state.levels.get(number);
    let tangential = match task.method {
        // Without friction, tractions are 0 for every method.
        _ if task.friction.is_frictionless() => Ok(LevelAnswer::without_traction(
            &mesh,
            &asked.motion,
            Skip::NoFriction,
        )),
        Method::LiuHsu => {
            let coarse = StripMesh::new(task, POLE_MESH).ok();
            let tolerance = task.tolerance(asked.index);
            on_level::solve(&mesh, coarse.as_ref(), &asked.motion, tolerance, monitor)
        }
        Method::Fastsim => {
            let motion = mesh.scale.motion(&asked.motion);
            Ok(fastsim::solve(task, &mesh, &motion))
        }
        Method::BoundaryElement | Method::Table => {
            boundary_elements(task, state, asked, number, coarser, monitor)
        }
    };
    let tangential =
        tangential.map_err(|failure| named(failure, task, task.first_motion + asked.index))?;
    let resultants = (0..task.footprint.patches().len())
        .map(|patch| Resultants::of_patch(&mesh, &tangential.traction, patch))
        .collect();
    Ok(DiscreteSolution {
        number,
        mesh,
        tangential,
        resultants,
    })
}

fn boundary_elements(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    number: usize,
    coarser: Option<&DiscreteSolution>,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    let mesh = state.levels.get(number);
    let motion = mesh.scale.motion(&asked.motion);
    let of_mesh = level_task(task, &mesh, &motion, asked.index);
    let is_unique = of_mesh.fall.is_none() && of_mesh.passage.is_none();
    // The start may decide which of several solutions is found, so it must be a function of the motion alone.
    let predicted = match is_unique {
        true => state.predictor.start(number, &motion, &mesh.bound),
        false => None,
    };
    let start = match (predicted, coarser) {
        (Some(start), _) => Some(start),
        (None, Some(coarser)) => {
            let traction = &coarser.tangential.traction;
            Some(prolonged(&coarser.mesh, traction, &mesh))
        }
        (None, None) => is_unique.then(|| fastsim::tractions(task, &mesh, &motion)),
    };
    let found = boundary_element::solve(of_mesh, start.as_ref(), &mut state.workspace, monitor)?;
    let is_predicting = task.motions.len() > 1 || task.forces[asked.index] != [None; 2];
    if is_unique && is_predicting && !found.is_without_traction() {
        state.predictor.remember(number, motion, &found.traction);
    }
    Ok(found)
}

/// Replaces the slips of the trapezoid rule on a mesh by smooth ones, if the three-point rule converges. Returns the work.
///
/// # Errors
/// The monitor may stop the work.
pub(crate) fn add_smooth_slips(
    task: &RollingTask,
    state: &mut RefinementState,
    asked: MotionTask,
    number: usize,
    answer: &mut LevelAnswer,
    monitor: &dyn Monitor,
) -> Result<Work, SolveError> {
    let is_smooth = answer.second.is_some() || answer.is_without_traction();
    if task.method != Method::BoundaryElement || is_smooth {
        return Ok(Work::default());
    }
    let mesh = state.levels.get(number);
    let motion = mesh.scale.motion(&asked.motion);
    let of_mesh = level_task(task, &mesh, &motion, asked.index);
    let before = answer.work;
    match boundary_element::smooth_slips(of_mesh, answer, &mut state.workspace, monitor) {
        Ok(()) | Err(LevelFailure::NotConverged { .. }) => Ok(answer.work.since(before)),
        Err(LevelFailure::Stopped(stop)) => Err(stop.into()),
    }
}

/// The equations of a motion on a mesh.
fn level_task<'a>(
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
        tolerance: task.tolerance(index),
    }
}

/// The client error for a failure at a point of the case.
pub(crate) fn named(failure: LevelFailure, task: &RollingTask, point: usize) -> SolveError {
    match failure {
        LevelFailure::Stopped(stop) => stop.into(),
        LevelFailure::NotConverged {
            work,
            tolerance,
            advice,
        } => SolveError::NotConverged {
            method: task.method,
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

/// A clause that names the most slender patch, if its length along rolling may be why there is no solution.
fn slender(task: &RollingTask) -> Option<String> {
    let ratio = |patch: &Patch| {
        let [x_min, x_max, y_min, y_max] = patch.extent;
        (x_max - x_min) / (y_max - y_min)
    };
    let patches = task.footprint.patches();
    let (number, patch) = patches
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)))?;
    let [x_min, x_max, y_min, y_max] = patch.extent;
    (ratio(patch) > SLENDER).then(|| {
        format!(
            "patch {number} at x = {} mm, y = {} mm, {} mm by {} mm, is {:.0} times as long along rolling as wide, \
             which fastsim solves in any case",
            short(0.5 * (x_min + x_max)),
            short(0.5 * (y_min + y_max)),
            short(x_max - x_min),
            short(y_max - y_min),
            ratio(patch)
        )
    })
}
