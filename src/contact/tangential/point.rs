//! One motion of a case, from the coarsest level to the finest, with an estimate of its error.

use crate::contact::case::{MeshSize, Method, Motion};
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::outputs::resultants::Resultants;
use crate::contact::problem::{Problem, Resolution};
use crate::contact::tangential::estimate::{self, Circumstances, Errors, Opinion};
use crate::contact::tangential::ladder::{CELLS_MAX, Ladder, Plan, Regime};
use crate::contact::tangential::level::Level;
use crate::contact::tangential::trail::Start;
use crate::contact::tangential::{
    Failure, Tangential, Work, boundary_element, fastsim, full_slip, liu_hsu, nested,
};

/// The coarse mesh that gives the method of Liu and Hsu its spin pole: fewer than 30 cells, as they found.
const POLE_MESH: MeshSize = MeshSize {
    strips: 5,
    cells: 5,
};
/// Error on a mesh made for the tractions over that on one of as many cells that was not, as far as the climb counts on it.
const MADE_FOR: f64 = 0.8;
/// Half octaves from which on steps of less than two times the cells do not pay.
const SMALL_STEPS_BELOW: i32 = 4;
/// A mesh of so many cells is worth a start on a coarser one, whose sides are no shorter than this.
const CELLS_NESTED: u64 = 1000;
const SIDE_HALVED: u32 = 8;
/// Levels of nearly the same size say nothing about each other.
const RATIO_MIN: f64 = 1.3;
/// Error of extrapolated resultants over that of the same without, as far as the climb counts on it.
const EXTRAPOLATED: f64 = 0.6;

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
    /// Estimated errors, see [`estimate::errors`].
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
    let last_path = std::mem::take(&mut ladder.path);
    match (sizes, problem.resolution) {
        (Some(sizes), _) => {
            let mut point = climb(problem, ladder, asked, sizes[0].into(), None, monitor)?;
            for size in &sizes[1..] {
                point = climb(problem, ladder, asked, (*size).into(), Some(point), monitor)?;
            }
            Ok(point)
        }
        (None, Resolution::Mesh(size)) => on_mesh(problem, ladder, asked, size, monitor),
        (None, Resolution::Target(target)) => {
            let again = again(problem, ladder, asked, &last_path, monitor)?;
            let (begun, half_octaves) = match again {
                Some(point) => (point, first_steps(target)),
                None => {
                    let first = ladder.plan(ladder.cells_first().round() as u32, Regime::Unknown);
                    let point = climb(problem, ladder, asked, first, None, monitor)?;
                    (point, 0)
                }
            };
            ascend(problem, ladder, asked, begun, half_octaves, target, monitor)
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
    climb(problem, ladder, asked, size.into(), coarser, monitor)
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
    let mut point = None;
    for plan in path {
        point = Some(climb(problem, ladder, asked, *plan, point, monitor)?);
    }
    Ok(point)
}

/// Begins a motion of a sweep on the level where the last motion had its first mesh made for its regime, if that serves
/// this one too.
fn again(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    last_path: &[usize],
    monitor: &dyn Monitor,
) -> Result<Option<Point>, SolveError> {
    let fitted = |number: &&usize| ladder.get(**number).plan.regime != Regime::Unknown;
    let Some(&number) = last_path.iter().find(fitted) else {
        return Ok(None);
    };
    let level = ladder.get(number);
    let motion = level.scale.motion(&asked.motion);
    if ladder.trail.start(number, level, &motion).is_none() {
        return Ok(None);
    }
    let plan = level.plan;
    let point = climb(problem, ladder, asked, plan, None, monitor)?;
    let found = regime_of(ladder, asked, &point);
    if plan.serves(found) {
        return Ok(Some(point));
    }
    // The tractions are a good start for a mesh that does.
    ladder.path.clear();
    let cells = ladder.get(number).mesh.cells() as u32;
    let plan = ladder.plan(cells, found);
    climb(problem, ladder, asked, plan, Some(point), monitor).map(Some)
}

fn regime_of(ladder: &Ladder, asked: Asked, point: &Point) -> Regime {
    let spinning = asked.motion.spin_per_mm != 0.0;
    estimate::regime(ladder.get(point.level), &point.tangential, spinning)
}

/// Climbs from a point on a level until the estimate meets the target or the levels end.
fn ascend(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    mut point: Point,
    mut half_octaves: i32,
    target: f64,
    monitor: &dyn Monitor,
) -> Result<Point, SolveError> {
    while let Some(error) = point.error().filter(|e| *e > target) {
        // Motions of a sweep share their levels: what each would like best is not what is cheapest for all.
        let alone = problem.part.all == 1;
        half_octaves += match (half_octaves == 0, alone) {
            (true, true) => first_steps(target).min(steps_made_for(error / target)),
            (true, false) => first_steps(target),
            (false, true) if half_octaves < SMALL_STEPS_BELOW => steps(error / target),
            (false, _) => steps(error / target).max(2),
        };
        let cells = ladder.cells_first() * 2.0_f64.powf(0.5 * f64::from(half_octaves));
        if cells > f64::from(CELLS_MAX) {
            break;
        }
        let regime = regime_of(ladder, asked, &point);
        let mut plan = ladder.plan(cells.round() as u32, regime);
        let before = ladder.get(point.level).plan.size.strips;
        if plan.size.strips == before {
            // Levels with the same strips say nothing about the strips.
            plan.size = MeshSize {
                strips: before + 2,
                cells: (plan.size.cells * before).div_ceil(before + 2),
            };
        }
        point = climb(problem, ladder, asked, plan, Some(point), monitor)?;
    }
    Ok(point)
}

/// By how many half octaves a mesh made for the tractions should be larger than the first one, when the error there is so many
/// times the target.
fn steps_made_for(excess: f64) -> i32 {
    ((2.0 * (MADE_FOR * excess).log2()).ceil() as i32).clamp(1, 4)
}

/// By how many half octaves the second level has more cells than the first at most: what most cases need.
fn first_steps(target: f64) -> i32 {
    ((0.04 / target).log2().round() as i32).clamp(1, 4)
}

/// By how many half octaves the number of cells should grow when the error is so many times the target: errors fall
/// about as 1/N and the next level can be extrapolated; steps of less than two times pay on coarse levels only, more than four
/// times nowhere. Coarse steps let the motions of a sweep share their levels.
fn steps(excess: f64) -> i32 {
    ((2.0 * (EXTRAPOLATED * excess).log2()).ceil() as i32).clamp(1, 4)
}

/// Solves a motion on the level of one size, from the point of a coarser one if there is one.
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
) -> Result<Point, SolveError> {
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
    let coarser_like = coarser.as_ref().filter(|point| {
        let below = ladder.get(point.level);
        let alike = problem.method == Method::LiuHsu || level.plan.is_like(&below.plan);
        alike && level.mesh.cells() as f64 > RATIO_MIN * below.mesh.cells() as f64
    });
    let share = coarser_like.map_or(0.0, |point| {
        let below = ladder.get(point.level).mesh.cells() as f64;
        below / (level.mesh.cells() as f64 - below)
    });
    let opinion = match coarser_like {
        Some(point) => Opinion::Coarser(&point.summed, share),
        None => Opinion::Alone,
    };
    let finer = match coarser_like {
        None => finer_for_sums(problem, level, asked, &tangential),
        Some(_) => None,
    };
    let errors = estimate::errors(
        problem,
        level,
        &tangential,
        &summed,
        opinion,
        Circumstances {
            motion: &asked.motion,
            finer: finer.as_ref(),
            slenderness: ladder.slenderness(),
            tolerance: tolerance(problem),
        },
    );
    let resultants = match coarser_like {
        // The rules of the fast solver share one order of convergence; the dense method has no such record.
        Some(point) if problem.method != Method::LiuHsu => {
            extrapolated(problem, &summed, point, share)
        }
        _ => summed.clone(),
    };
    ladder.trail.leave(number, motion, &tangential);
    ladder.path.push(number);
    let mut work = coarser.as_ref().map_or(Work::default(), |point| point.work);
    work.add(tangential.work);
    let seconds =
        (monitor.elapsed() - began).as_secs_f64() + coarser.map_or(0.0, |point| point.seconds);
    Ok(Point {
        motion: asked.motion,
        saturated: false,
        tangential,
        level: number,
        resultants,
        summed,
        errors,
        work,
        method: method_used(problem),
        seconds,
    })
}

/// A level of four times as many cells, where everything slips and the tractions turn: how they add up depends on the
/// cells. Without spin all tractions point the same way, and cells of any size add up to the load.
fn finer_for_sums(
    problem: &Problem,
    level: &Level,
    asked: Asked,
    answer: &Tangential,
) -> Option<Level> {
    let turns = asked.motion.spin_per_mm != 0.0 && problem.friction > 0.0;
    if !turns || !answer.slips.iter().all(|slips| *slips) {
        return None;
    }
    let [strips, cells] = [level.plan.size.strips, level.plan.size.cells].map(|n| 2 * n);
    let size = MeshSize { strips, cells };
    Level::new(problem, Plan { size, ..level.plan }).ok()
}

/// The resultants of every patch where the climb leads to.
fn extrapolated(
    problem: &Problem,
    summed: &[Resultants],
    coarser: &Point,
    share: f64,
) -> Vec<Resultants> {
    let patches = problem.region.patches();
    let pairs = summed.iter().zip(&coarser.summed).zip(&patches);
    pairs
        .map(|((fine, coarse), patch)| {
            fine.beyond(*coarse, share, problem.friction * patch.normal_force)
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
fn tolerance(problem: &Problem) -> f64 {
    match problem.resolution {
        Resolution::Target(target) => {
            // A force is searched as a function of its creepage: what the iteration leaves is noise to that.
            let searched = problem.forces.iter().any(|forces| *forces != [None; 2]);
            let part = if searched { 0.004 } else { 0.04 };
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
            advice,
        },
    }
}

/// Tractions of a coarser level on a finer one; relative to the friction bound they vary less than as they are.
fn nested_start(coarse: &Level, answer: &Tangential, level: &Level) -> Start {
    let relative = |values: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(&coarse.bound)
            .map(|(t, g)| if *g > 0.0 { t / g } else { 0.0 })
            .collect()
    };
    let second = answer.second.as_ref().unwrap_or(&answer.traction);
    let mirror = [0, 1].map(|k| {
        let mut values = nested::interpolate(&coarse.mesh, &relative(&second[k]), &level.mesh);
        values
            .iter_mut()
            .zip(&level.bound)
            .for_each(|(t, g)| *t *= g);
        values
    });
    Start {
        mirror,
        trapezoid: None,
    }
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
        return liu_hsu::on_level::solve(
            level,
            coarse.as_ref(),
            motion,
            tolerance(problem),
            monitor,
        );
    }
    let motion = level.scale.motion(motion);
    if problem.method == Method::Fastsim {
        return Ok(fastsim::solve(problem, level, &motion));
    }
    boundary_element::solve(level, &motion, start.as_ref(), tolerance(problem), monitor)
}
