//! From a target to meshes: solves a motion on finer and finer meshes until the estimate of the error meets the target.

use crate::contact::case::problem::{Problem, Resolution};
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::Work;
use crate::contact::rolling::refinement::companions::{Companion, Seen};
use crate::contact::rolling::refinement::constants::{
    CELLS_FINE, EXTRAPOLATED, FINE_TARGET, MARGIN, SLACK,
};
use crate::contact::rolling::refinement::error_estimate::Indicators;
use crate::contact::rolling::refinement::levels::{CELLS_MAX, Ladder, Plan, Regime};
use crate::contact::rolling::refinement::refine::{Asked, Point, Solved, climb};
use crate::contact::rolling::regime::regime;

/// Half octaves from which on steps of less than two times the cells do not pay.
const SMALL_STEPS_BELOW: i32 = 4;

/// Solves a motion from the coarsest mesh, or where the last motion of a sweep ended, up to the first mesh that meets the target.
///
/// A mesh is refused on what it says itself; only one that is not is solved again on its companions, first on half the
/// strips, then on half the cells.
///
/// # Errors
/// Why there is no answer.
pub(crate) fn to_target(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    target: f64,
    monitor: &dyn Monitor,
) -> Result<Point, SolveError> {
    let begun = match ladder.begin.take() {
        Some(plan) => again(problem, ladder, asked, plan, monitor)?,
        None => None,
    };
    let mut solved = match begun {
        Some(solved) => solved,
        None => {
            let first = ladder.plan(ladder.cells_first().round() as u32, Regime::Unknown);
            climb(problem, ladder, asked, first, None, monitor)?
        }
    };
    loop {
        let small = target < FINE_TARGET && cells(ladder, &solved.point) < CELLS_FINE;
        let larger = half_octaves(ladder, &solved.point) < half_octaves_max(ladder);
        if !(small && larger) {
            judge(
                problem,
                ladder,
                asked,
                &mut solved,
                larger.then_some(target),
                monitor,
            )?;
            if solved.point.error().is_some_and(|error| error <= target) {
                break;
            }
        }
        if !larger {
            break;
        }
        let plan = next(problem, ladder, asked, &solved.point, target);
        solved = climb(problem, ladder, asked, plan, Some(solved.point), monitor)?;
    }
    ladder.begin = Some(next_begin(ladder, &solved.point, target));
    Ok(solved.point)
}

/// Solves the companions of a level and what they tell of value and error; with a target only as long as the estimate may
/// still meet it.
///
/// # Errors
/// Why there is no answer.
pub(crate) fn judge(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    solved: &mut Solved,
    target: Option<f64>,
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    if !matches!(solved.indicators, Indicators::Measured(_)) {
        return Ok(());
    }
    let began = monitor.elapsed();
    let mut seen = [Seen::Untried, Seen::Untried];
    let point = &mut solved.point;
    for (k, which) in [Companion::Across, Companion::Along]
        .into_iter()
        .enumerate()
    {
        if target.is_some_and(|target| point.error().is_none_or(|error| error > target)) {
            break;
        }
        let (found, work) = which.solve(
            problem,
            ladder,
            point.level,
            &point.tangential,
            &asked.motion,
            monitor,
        )?;
        solved.indicators.see(problem, k, &point.summed, &found);
        seen[k] = found;
        point.work.add(Work {
            residual: point.work.residual,
            ..work
        });
        point.errors = solved.indicators.errors();
    }
    if let [Seen::Found(across, strips), Seen::Found(along, cells)] = &seen
        && ladder.get(point.level).plan.pole().is_none()
    {
        for (p, patch) in problem.region.patches().iter().enumerate() {
            let bound = problem.friction * patch.normal_force;
            let companions = [(across[p], strips), (along[p], cells)];
            let companions = companions.map(|(other, reach)| (other, EXTRAPOLATED * reach));
            point.resultants[p] = point.summed[p].beyond_all(companions, bound);
        }
    }
    point.seconds += (monitor.elapsed() - began).as_secs_f64();
    Ok(())
}

/// Begins a motion of a sweep on the mesh where the last motion ended, if that serves this one too.
fn again(
    problem: &Problem,
    ladder: &mut Ladder,
    asked: Asked,
    plan: Plan,
    monitor: &dyn Monitor,
) -> Result<Option<Solved>, SolveError> {
    if plan.regime == Regime::Unknown {
        return Ok(None);
    }
    let number = ladder.level(plan)?;
    let level = ladder.get(number);
    let motion = level.scale.motion(&asked.motion);
    if ladder.trail.start(number, level, &motion).is_none() {
        return Ok(None);
    }
    let solved = climb(problem, ladder, asked, plan, None, monitor)?;
    let found = regime_of(ladder, asked, &solved.point);
    if plan.serves(found) {
        return Ok(Some(solved));
    }
    // The tractions are a good start for a mesh that does.
    ladder.path.clear();
    let cells = ladder.get(number).mesh.cells() as u32;
    let plan = ladder.plan(cells, found);
    climb(problem, ladder, asked, plan, Some(solved.point), monitor).map(Some)
}

fn regime_of(ladder: &Ladder, asked: Asked, point: &Point) -> Regime {
    let spinning = asked.motion.spin_per_mm != 0.0;
    regime(ladder.get(point.level), &point.tangential, spinning)
}

fn cells(ladder: &Ladder, point: &Point) -> usize {
    ladder.get(point.level).mesh.cells()
}

/// By how many half octaves a mesh has more cells than the first one.
fn half_octaves(ladder: &Ladder, point: &Point) -> i32 {
    let ratio = cells(ladder, point) as f64 / ladder.cells_first();
    (2.0 * ratio.log2()).round() as i32
}

/// The same for the largest mesh.
fn half_octaves_max(ladder: &Ladder) -> i32 {
    (2.0 * (f64::from(CELLS_MAX) / ladder.cells_first()).log2() + 1e-9).floor() as i32
}

/// The mesh after one whose estimate is too large: errors fall about as 1/N.
fn next(problem: &Problem, ladder: &Ladder, asked: Asked, point: &Point, target: f64) -> Plan {
    let here = half_octaves(ladder, point);
    let excess = point.error().map_or(1.0, |error| error / target);
    // Coarse steps let the motions of a sweep share their levels.
    let alone = problem.part.all == 1;
    let least = if alone && here < SMALL_STEPS_BELOW {
        1
    } else {
        2
    };
    let step = ((2.0 * (MARGIN * excess).log2()).ceil() as i32).clamp(least, 4);
    at(
        ladder,
        (here + step).min(half_octaves_max(ladder)),
        regime_of(ladder, asked, point),
    )
}

fn at(ladder: &Ladder, half_octaves: i32, regime: Regime) -> Plan {
    let cells = ladder.cells_first() * 2.0_f64.powf(0.5 * f64::from(half_octaves));
    ladder.plan(cells.round() as u32, regime)
}

/// Where the next motion of a sweep should begin: on the same mesh, which keeps estimates and values continuous, until
/// it is much finer than it need be.
fn next_begin(ladder: &Ladder, point: &Point, target: f64) -> Plan {
    let plan = ladder.get(point.level).plan;
    let here = half_octaves(ladder, point);
    if here >= 2 && point.error().is_some_and(|error| error < SLACK * target) {
        return at(ladder, here - 2, plan.regime);
    }
    plan
}

/// Does a problem ask for an error rather than a mesh?
pub(crate) fn target(problem: &Problem) -> Option<f64> {
    match problem.resolution {
        Resolution::Target(target) => Some(target),
        Resolution::Mesh(_) => None,
    }
}
