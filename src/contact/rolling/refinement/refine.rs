//! One motion of a case, from the coarsest level to the finest, with an estimate of its error.

use crate::contact::case::problem::{Problem, Resolution};
use crate::contact::case::words::{MeshSize, Method, Motion};
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::region::Patch;
use crate::contact::rolling::answer::{Failure, Tangential, Work};
use crate::contact::rolling::methods::boundary_element::solve as boundary_element;
use crate::contact::rolling::methods::liu_hsu::on_level;
use crate::contact::rolling::methods::{fastsim, full_slip};
use crate::contact::rolling::refinement::constants::LEVEL_RATIO_MIN;
use crate::contact::rolling::refinement::error_estimate;
use crate::contact::rolling::refinement::error_estimate::{
    Before, Circumstances, Errors, Indicators,
};
use crate::contact::rolling::refinement::levels::{Ladder, Plan, Regime};
use crate::contact::rolling::refinement::warm_start::Start;
use crate::contact::rolling::refinement::{interpolate, mesh_policy};
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::strip_mesh::Level;

/// The coarse mesh that gives the method of Liu and Hsu its spin pole: fewer than 30 cells, as they found.
const POLE_MESH: MeshSize = MeshSize {
    strips: 5,
    cells: 5,
};
/// A mesh of so many cells is worth a start on a coarser one, whose sides are no shorter than this.
const CELLS_NESTED: u64 = 1000;
const SIDE_HALVED: u32 = 8;
/// Patches longer along rolling than so many times their width are named where a solve does not converge; nearly all of them are solved.
const SLENDER: f64 = 20.0;
/// A motion of a problem, and the creepages it is solved with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// The number of the motion.
    pub index: usize,
    /// Creepages and spin.
    pub motion: Motion,
}

/// The answer for one motion on the finest level it needed.
#[derive(Debug, Clone)]
pub struct Point {
    /// The motion it was solved for.
    pub motion: Motion,
    /// A prescribed force could not be reached.
    pub saturated: bool,
    /// Tractions, slips and zones.
    pub tangential: Tangential,
    /// The number of that level in the ladder.
    pub level: usize,
    /// Resultants of every patch about the origin of the case: the best known.
    pub resultants: Vec<Resultants>,
    /// The same as the tractions give them, without extrapolation.
    pub summed: Vec<Resultants>,
    /// Estimated errors, see [`Indicators::errors`].
    pub errors: Errors,
    /// Work over all levels.
    pub work: Work,
    /// The method that was used.
    pub method: Method,
    /// Wall time in s.
    pub seconds: f64,
}

impl Point {
    /// Estimated error of the sum over the patches.
    #[must_use]
    pub fn error(&self) -> Option<f64> {
        self.errors.last().copied().flatten()
    }
}

/// A point with what its error is judged by.
#[derive(Debug, Clone)]
pub struct Solved {
    /// The answer.
    pub point: Point,
    /// The indicators of its level.
    pub indicators: Indicators,
}

/// Solves a motion, from the coarsest level up to the first that meets the target, each started from
/// the one before.
///
/// # Errors
/// Why there is no answer.
pub fn solve(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    monitor: &dyn Monitor,
) -> Result<Point, SolveError> {
    let sizes = Ladder::fixed_sizes(problem.resolution, problem.method);
    ladder.path.clear();
    match (sizes, problem.resolution) {
        (Some(sizes), _) => {
            let mut solved = climb(problem, ladder, asked, sizes[0].into(), None, monitor)?;
            for size in &sizes[1..] {
                let below = Some(solved.point);
                solved = climb(problem, ladder, asked, (*size).into(), below, monitor)?;
            }
            Ok(solved.point)
        }
        (None, Resolution::Mesh(size)) => on_mesh(problem, ladder, asked, size, monitor),
        (None, Resolution::Target(target)) => {
            mesh_policy::to_target(problem, ladder, asked, target, monitor)
        }
    }
}

/// Solves a motion on a mesh of the client's, a large one from a start on meshes of half as many strips and cells.
fn on_mesh(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    size: MeshSize,
    monitor: &dyn Monitor,
) -> Result<Point, SolveError> {
    let cells = |size: MeshSize| u64::from(size.strips) * u64::from(size.cells);
    let mut coarser = None;
    let half = MeshSize {
        strips: (size.strips / 4 * 2).max(SIDE_HALVED),
        cells: (size.cells / 2).max(SIDE_HALVED),
    };
    let number = ladder.level(size.into())?;
    let level = ladder.get(number);
    let motion = level.scale.motion(&asked.motion);
    let started = ladder.trail.start(number, level, &motion).is_some();
    if !started && cells(size) >= CELLS_NESTED && 2 * cells(half) <= cells(size) {
        coarser = match on_mesh(problem, ladder, asked, half, monitor) {
            Ok(point) => Some(point),
            // The mesh that was asked for may do better.
            Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }) => None,
            Err(error) => return Err(error),
        };
    }
    climb(problem, ladder, asked, size.into(), coarser, monitor).map(|solved| solved.point)
}

/// Solves a motion on given levels, one after the other, so that the resultants are one function of the motion.
///
/// # Errors
/// Why there is no answer.
pub fn along(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    path: &[Plan],
    monitor: &dyn Monitor,
) -> Result<Option<Point>, SolveError> {
    ladder.path.clear();
    let mut solved: Option<Solved> = None;
    for plan in path {
        let below = solved.map(|solved| solved.point);
        solved = Some(climb(problem, ladder, asked, *plan, below, monitor)?);
    }
    if let Some(solved) = &mut solved {
        mesh_policy::judge(problem, ladder, asked, solved, None, monitor)?;
    }
    Ok(solved.map(|solved| solved.point))
}

/// Solves a motion on the level of one size, from the point of a coarser one if there is one. Estimates are those before
/// companions, see `judge`.
///
/// # Errors
/// Why there is no answer.
pub fn climb(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    plan: Plan,
    coarser: Option<Point>,
    monitor: &dyn Monitor,
) -> Result<Solved, SolveError> {
    let began = monitor.elapsed();
    let number = ladder.level(plan)?;
    let level = ladder.get(number);
    let below = coarser
        .as_ref()
        .map(|point| (ladder.get(point.level), &point.tangential));
    let motion = level.scale.motion(&asked.motion);
    let warm = ladder.trail.start(number, level, &motion);
    let start = warm.or_else(|| below.map(|(coarse, answer)| nested_start(coarse, answer, level)));
    let tangential = solve_level(problem, level, &asked.motion, start, monitor)
        .map_err(|f| named(f, problem, problem.part.before + asked.index))?;
    let patches = problem.region.patches().len();
    let summed: Vec<Resultants> = (0..patches)
        .map(|p| Resultants::of_patch(level, &tangential.traction, p))
        .collect();
    let before = coarser
        .as_ref()
        .and_then(|point| before(ladder, level, point));
    let finer = finer_for_sums(problem, level, asked, &tangential);
    let circumstances = Circumstances {
        motion: &asked.motion,
        before,
        finer: finer.as_ref(),
        slenderness: ladder.slenderness(),
        tolerance: tolerance(problem),
    };
    let indicators = Indicators::of_level(problem, level, &tangential, &summed, circumstances);
    let resultants = extrapolated(problem, level, &summed, before);
    ladder.trail.leave(number, motion, &tangential);
    ladder.path.push(number);
    let mut work = coarser.as_ref().map_or(Work::default(), |point| point.work);
    work.add(tangential.work);
    let seconds =
        (monitor.elapsed() - began).as_secs_f64() + coarser.map_or(0.0, |point| point.seconds);
    let point = Point {
        motion: asked.motion,
        saturated: false,
        tangential,
        level: number,
        resultants,
        summed,
        errors: indicators.errors(),
        work,
        method: method_used(problem),
        seconds,
    };
    Ok(Solved { point, indicators })
}

/// The level before, if it is coarse enough to say something.
fn before<'a>(ladder: &Ladder, level: &Level, point: &'a Point) -> Option<Before<'a>> {
    let below = ladder.get(point.level);
    let ratio = level.mesh.cells() as f64 / below.mesh.cells() as f64;
    (ratio >= LEVEL_RATIO_MIN).then(|| Before {
        summed: &point.summed,
        regime: below.plan.regime,
        share: 1.0 / (ratio - 1.0),
    })
}

/// A level of four times as many cells, where the pressure jumps, or everything slips and the tractions turn: how they add up
/// depends on the cells. Without spin all tractions point the same way, and cells of any size add up to the load.
fn finer_for_sums(
    problem: &Problem,
    level: &Level,
    asked: Asked,
    answer: &Tangential,
) -> Option<Level> {
    let turns = asked.motion.spin_per_mm != 0.0 && problem.friction > 0.0;
    let slides = turns && answer.slips.iter().all(|slips| *slips);
    if !slides && !error_estimate::jumps(problem) {
        return None;
    }
    let [strips, cells] = [level.plan.size.strips, level.plan.size.cells].map(|n| 2 * n);
    let size = MeshSize { strips, cells };
    Level::new(problem, Plan { size, ..level.plan }).ok()
}

/// The resultants of every patch where the climb leads to: between meshes for stick errors fall as 1/N. The dense method and
/// meshes gathered about a pole have no such record.
fn extrapolated(
    problem: &Problem,
    level: &Level,
    summed: &[Resultants],
    before: Option<Before>,
) -> Vec<Resultants> {
    let sticking = |regime| matches!(regime, Regime::Sticking { .. });
    let like = before.filter(|b| sticking(b.regime) && sticking(level.plan.regime));
    let Some(before) = like.filter(|_| mesh_policy::target(problem).is_some()) else {
        return summed.to_vec();
    };
    let patches = problem.region.patches();
    let pairs = summed.iter().zip(before.summed).zip(&patches);
    pairs
        .map(|((fine, coarse), patch)| {
            fine.beyond(*coarse, before.share, problem.friction * patch.normal_force)
        })
        .collect()
}

/// `auto` is the fast solver today.
fn method_used(problem: &Problem) -> Method {
    match problem.method {
        Method::Auto | Method::BoundaryElement => Method::BoundaryElement,
        Method::LiuHsu => Method::LiuHsu,
        Method::Fastsim => Method::Fastsim,
    }
}

/// Residual to reach: far below the target, since every iteration below it is for nothing.
pub(crate) fn tolerance(problem: &Problem) -> f64 {
    match problem.resolution {
        Resolution::Target(target) => {
            // A force is searched as a function of its creepage: what the iteration leaves is noise to that.
            let searched = problem.forces.iter().any(|forces| *forces != [None; 2]);
            // Ten times less than a force may be missed by (`SHARE_OF_TARGET`): a start that meets it is left as it is.
            let part = if searched { 0.0015 } else { 0.04 };
            (part * target).clamp(boundary_element::TOLERANCE, 4e-4)
        }
        Resolution::Mesh(_) => boundary_element::TOLERANCE,
    }
}

fn named(failure: Failure, problem: &Problem, point: usize) -> SolveError {
    match failure {
        Failure::Stopped(stop) => stop.into(),
        Failure::NotConverged {
            work,
            tolerance,
            advice,
        } => SolveError::NotConverged {
            method: method_used(problem),
            point,
            iterations: work.iterations as usize,
            residual: work.residual,
            tolerance,
            advice: match slender(problem) {
                Some(slender) => format!("{slender}; {advice}"),
                None => advice,
            },
        },
    }
}

/// The patch that is longest along rolling for its width, as a clause, if it may be the reason why there is no answer.
fn slender(problem: &Problem) -> Option<String> {
    let ratio = |patch: &Patch| {
        let [x_min, x_max, y_min, y_max] = patch.extent;
        (x_max - x_min) / (y_max - y_min)
    };
    let patches = problem.region.patches();
    let (number, patch) = patches
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)))?;
    let [x_min, x_max, y_min, y_max] = patch.extent;
    (ratio(patch) > SLENDER).then(|| {
        format!(
            "patch {number} at x {x_min:.2} to {x_max:.2} mm, y {y_min:.3} to {y_max:.3} mm is {:.0} times as long along \
             rolling as wide, which fastsim solves in any case",
            ratio(patch)
        )
    })
}

/// A start from the answer on a coarser level.
fn nested_start(coarse: &Level, answer: &Tangential, level: &Level) -> Start {
    let second = answer.second.as_ref().unwrap_or(&answer.traction);
    Start {
        mirror: nested_tractions(coarse, second, level),
        trapezoid: None,
    }
}

/// Tractions of one level on another; relative to the friction bound they vary less than as they are.
pub(crate) fn nested_tractions(
    from: &Level,
    traction: &[Vec<f64>; 2],
    to: &Level,
) -> [Vec<f64>; 2] {
    let relative = |values: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(&from.bound)
            .map(|(t, g)| if *g > 0.0 { t / g } else { 0.0 })
            .collect()
    };
    [0, 1].map(|k| {
        let mut values = interpolate::interpolate(&from.mesh, &relative(&traction[k]), &to.mesh);
        values.iter_mut().zip(&to.bound).for_each(|(t, g)| *t *= g);
        values
    })
}

fn solve_level(
    problem: &Problem,
    level: &Level,
    motion: &Motion,
    start: Option<Start>,
    monitor: &dyn Monitor,
) -> Result<Tangential, Failure> {
    if problem.friction == 0.0 {
        return Ok(full_slip::frictionless_answer(level, motion));
    }
    if problem.method == Method::LiuHsu {
        let coarse = Level::new(problem, POLE_MESH).ok();
        return on_level::solve(level, coarse.as_ref(), motion, tolerance(problem), monitor);
    }
    let motion = level.scale.motion(motion);
    if problem.method == Method::Fastsim {
        return Ok(fastsim::solve(problem, level, &motion));
    }
    boundary_element::solve(level, &motion, start.as_ref(), tolerance(problem), monitor)
}
