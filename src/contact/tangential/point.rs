//! One motion of a case, from the coarsest level to the finest, with an estimate of its error.

use crate::contact::case::{MeshSize, Method, Motion};
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::Patch;
use crate::contact::outputs::resultants::Resultants;
use crate::contact::problem::{Problem, Resolution};
use crate::contact::tangential::level::Level;
use crate::contact::tangential::{
    Failure, Tangential, Work, boundary_element, full_slip, liu_hsu, nested,
};

/// On a single mesh the difference of the two rules times this covers the error (measured on Hertz contacts: it did
/// in 95 % of the cases at 64 to 150 cells).
const RULES_SAFETY: f64 = 2.5;
/// The coarse mesh that gives the method of Liu and Hsu its spin pole: fewer than 30 cells, as they found.
const POLE_MESH: MeshSize = MeshSize {
    strips: 5,
    cells: 5,
};
/// Relative error where everything slips along the rigid slip.
const RIGID_ERROR: f64 = 1e-6;

/// The answer for one motion on the finest level.
#[derive(Debug, Clone)]
pub struct Point {
    /// Tractions, slips and zones.
    pub tangential: Tangential,
    /// Resultants of every patch about the origin of the case.
    pub resultants: Vec<Resultants>,
    /// Estimated error of every patch relative to its μN (moment: μN√(A/π) about its middle), then that of the sum;
    /// nothing where there is no second opinion.
    pub errors: Vec<Option<f64>>,
    /// Work over all levels.
    pub work: Work,
    /// The method that was used.
    pub method: Method,
    /// Wall time in s.
    pub seconds: f64,
}

/// Solves motion `index` of the problem on the levels, each started from the one before.
///
/// # Errors
/// Why there is no answer.
pub fn solve(
    problem: &Problem,
    levels: &[Level],
    index: usize,
    monitor: &dyn Monitor,
) -> Result<Point, SolveError> {
    let began = monitor.elapsed();
    let motion = problem.motions[index];
    let mut work = Work::default();
    let mut answers: Vec<Tangential> = Vec::with_capacity(levels.len());
    for (k, level) in levels.iter().enumerate() {
        let coarser = k.checked_sub(1).map(|c| (&levels[c], &answers[c]));
        let answer = solve_level(problem, level, &motion, coarser, monitor)
            .map_err(|f| named(f, problem, index))?;
        work.add(answer.work);
        answers.push(answer);
    }
    let patches = problem.region.patches();
    let resultants = |k: usize, traction: &[Vec<f64>; 2]| -> Vec<Resultants> {
        (0..patches.len())
            .map(|p| Resultants::of_patch(&levels[k], traction, p))
            .collect()
    };
    let finest = levels.len() - 1;
    let found = resultants(finest, &answers[finest].traction);
    let by_rules = answers[finest]
        .second
        .as_ref()
        .map(|t| resultants(finest, t));
    let by_levels = finest
        .checked_sub(1)
        .map(|k| resultants(k, &answers[k].traction));
    let errors = errors(
        problem,
        &patches,
        &found,
        by_levels.as_deref(),
        by_rules.as_deref(),
        &answers[finest],
    );
    let Some(tangential) = answers.pop() else {
        unreachable!("a case has at least one level")
    };
    let seconds = (monitor.elapsed() - began).as_secs_f64();
    Ok(Point {
        tangential,
        resultants: found,
        errors,
        work,
        method: method_used(problem),
        seconds,
    })
}

/// `auto` is the fast solver today.
fn method_used(problem: &Problem) -> Method {
    match problem.method {
        Method::Auto | Method::BoundaryElement => Method::BoundaryElement,
        Method::LiuHsu => Method::LiuHsu,
    }
}

/// Residual to reach: far below the target, since every iteration below it is for nothing.
fn tolerance(problem: &Problem) -> f64 {
    match problem.resolution {
        Resolution::Target(target) => (0.02 * target).clamp(boundary_element::TOLERANCE, 1e-4),
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

fn solve_level(
    problem: &Problem,
    level: &Level,
    motion: &Motion,
    coarser: Option<(&Level, &Tangential)>,
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
    let start = coarser.map(|(coarse, answer)| {
        // Tractions relative to the friction bound vary less than tractions do.
        let relative = |values: &[f64]| -> Vec<f64> {
            values
                .iter()
                .zip(&coarse.bound)
                .map(|(t, g)| if *g > 0.0 { t / g } else { 0.0 })
                .collect()
        };
        let second = answer.second.as_ref().unwrap_or(&answer.traction);
        [0, 1].map(|k| {
            let mut values = nested::interpolate(&coarse.mesh, &relative(&second[k]), &level.mesh);
            values
                .iter_mut()
                .zip(&level.bound)
                .for_each(|(t, g)| *t *= g);
            values
        })
    });
    boundary_element::solve(level, &motion, start.as_ref(), tolerance(problem), monitor)
}

/// Estimated errors of the patches and of their sum: the change from the level before where there is one, else the
/// difference of the two rules with a safety factor.
fn errors(
    problem: &Problem,
    patches: &[Patch],
    found: &[Resultants],
    by_levels: Option<&[Resultants]>,
    by_rules: Option<&[Resultants]>,
    answer: &Tangential,
) -> Vec<Option<f64>> {
    if problem.friction == 0.0 {
        return vec![Some(0.0); patches.len() + 1];
    }
    if answer.second.is_none() && answer.work.products == 0 {
        let still = !answer.slips.iter().any(|s| *s);
        return vec![Some(if still { 0.0 } else { RIGID_ERROR }); patches.len() + 1];
    }
    let (other, factor) = match (by_levels, by_rules) {
        (Some(other), _) => (other, 1.0),
        (None, Some(other)) => (other, RULES_SAFETY),
        (None, None) => return vec![None; patches.len() + 1],
    };
    let middle = |p: &Patch| {
        [
            0.5 * (p.extent[0] + p.extent[1]),
            0.5 * (p.extent[2] + p.extent[3]),
        ]
    };
    let mut errors: Vec<Option<f64>> = Vec::with_capacity(patches.len() + 1);
    let (mut sum, mut sum_other) = (Resultants::default(), Resultants::default());
    let (mut force, mut area, mut centre) = (0.0, 0.0, [0.0, 0.0]);
    for ((patch, found), other) in patches.iter().zip(found).zip(other) {
        let bound = problem.friction * patch.normal_force;
        let at = middle(patch);
        let length = (patch.area / std::f64::consts::PI).sqrt();
        errors.push(Some(
            factor * found.about(at).distance(&other.about(at), bound, length),
        ));
        sum = sum.plus(*found);
        sum_other = sum_other.plus(*other);
        force += bound;
        area += patch.area;
        centre = [centre[0] + bound * at[0], centre[1] + bound * at[1]];
    }
    let centre = centre.map(|c| c / force);
    let length = (area / std::f64::consts::PI).sqrt();
    errors.push(Some(
        factor
            * sum
                .about(centre)
                .distance(&sum_other.about(centre), force, length),
    ));
    errors
}
