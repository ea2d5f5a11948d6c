//! What is the physics? Plain synchronous arithmetic: no async, files, environment or printing.
//!
//! Units everywhere: mm, N, MPa, rad; creepages are dimensionless, spin is in 1/mm.

pub mod case;
pub mod error;
pub mod geometry;
pub mod influence;
pub mod mesh;
pub mod monitor;
pub mod normal;
pub mod outputs;
pub mod problem;
mod profiles;
mod read;
pub mod remark;
pub mod solution;
pub mod tangential;
pub mod zones;

use std::rc::Rc;

use serde_json::Value;

use crate::contact::error::{CaseError, SolveError};
use crate::contact::monitor::{Monitor, Watch};
use crate::contact::normal::Region;
use crate::contact::outputs::assemble::{assemble, wants_fields};
use crate::contact::problem::{Limits, Problem};
use crate::contact::solution::{Fields, Solution};
use crate::contact::tangential::forces;
use crate::contact::tangential::ladder::{Ladder, Plan, Regime};
use crate::contact::tangential::point::Point;
use crate::contact::tangential::prepared::Cache;

/// Reads and checks a case.
///
/// # Errors
/// Every fault of the case at once: those of the text, and those of its sound parts against physics and limits.
pub fn check(case: &Value, limits: &Limits) -> Result<Problem, CaseError> {
    let (draft, mut faults) = read::draft(case);
    if !faults.is_empty() {
        faults.extend(draft.faults_beside(limits));
        return Err(CaseError(faults));
    }
    Problem::new(&draft.complete().ok_or(CaseError(faults))?, limits)
}

/// Solves a checked case: region and pressure where they are not known yet, then every motion from a coarse mesh level
/// up to the first that meets the target; of a wheel on a rail patch by patch.
///
/// # Errors
/// A named reason why there is no answer.
pub fn solve(problem: &Problem, monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    solve_with(&Rc::default(), problem, monitor)
}

/// The same for one of many problems: what patches of the same shape have in common is kept for the next.
///
/// # Errors
/// The same.
pub fn solve_with(
    cache: &Rc<Cache>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    if let Region::Profiles(contact) = &problem.region {
        return profiles::solve(cache, problem, contact, monitor);
    }
    let watch = Watch::new(monitor, problem.time_limit, problem.motions.len());
    answer(cache, problem.pressed(&watch)?.as_ref(), &watch)
}

/// Solves every motion of a problem whose region and pressure are known.
fn answer(
    cache: &Rc<Cache>,
    problem: &Problem,
    watch: &Watch,
) -> Result<(Solution, Fields), SolveError> {
    let mut ladder = Ladder::new(problem, cache);
    let mut points = Vec::with_capacity(problem.motions.len());
    for index in 0..problem.motions.len() {
        let point = forces::solve(problem, &mut ladder, index, points.last(), watch)?;
        points.push(point);
        watch.advance();
    }
    if wants_fields(problem) {
        points = on_one_level(problem, &mut ladder, points, watch)?;
    }
    if let (Some(first), Some(normal)) = (points.first_mut(), problem.normal) {
        // What all motions share is charged to the first.
        first.seconds += normal.seconds;
    }
    Ok(assemble(problem, &ladder, &points))
}

/// Brings every point to one level as fine as the finest that any of them needed, gathered about none of their poles: the
/// fields of a patch share their cells.
fn on_one_level(
    problem: &Problem,
    ladder: &mut Ladder,
    points: Vec<Point>,
    monitor: &dyn Monitor,
) -> Result<Vec<Point>, SolveError> {
    let cells = |point: &Point| ladder.get(point.level).mesh.cells();
    let Some(finest) = points.iter().max_by_key(|p| cells(p)).map(|p| p.level) else {
        return Ok(points);
    };
    let size = ladder.get(finest).plan.size;
    let plan = Plan {
        size,
        regime: Regime::Sticking,
    };
    if points.iter().all(|point| point.level == finest) {
        return Ok(points);
    }
    let lift = |(index, point): (usize, Point)| {
        if ladder.get(point.level).plan == plan {
            return Ok(point);
        }
        forces::lift(problem, ladder, index, plan, point, monitor)
    };
    points.into_iter().enumerate().map(lift).collect()
}
