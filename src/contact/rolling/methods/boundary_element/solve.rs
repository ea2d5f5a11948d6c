//! The solve of one motion on one mesh.
//!
//! Tractions, zones and forces are those of the trapezoid rule. Its slips alternate from cell to cell, so slips for output come from the three-point rule
//! ([`smooth_slips`]), with the directions of the tractions as Coulomb's law demands. The three-point rule also gives a start where the given one fails, and
//! bounds that depend on the slip.

use crate::half_space::strip_operator::kind::Parity;
use crate::monitor::Monitor;
use crate::remark::list::Remark;
use crate::rolling::answer::Skip;
use crate::rolling::answer::{LevelAnswer, LevelFailure, project_on_bound};
use crate::rolling::methods::boundary_element::rule_sequence::RuleSequence;
use crate::rolling::methods::boundary_element::task::{FEW_STEPS, LevelTask, STEPS_MAX};
use crate::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::rolling::strip_mesh::StripMesh;

/// Solves one motion on one mesh, from a start or from zero tractions.
///
/// Bounds that depend on the slip are those of the three-point rule, because the slips of the trapezoid rule alternate.
///
/// # Errors
/// [`LevelFailure::NotConverged`] if no start leads to a solution; [`LevelFailure::Stopped`] if the monitor stops the work. If only the trapezoid rule fails,
/// the solution has the three-point tractions and a remark.
pub fn solve(
    task: LevelTask,
    start: Option<&[Vec<f64>; 2]>,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    if let Some(answer) = task.without_iteration() {
        return Ok(answer);
    }
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, workspace, monitor);
    let skip = symmetry(task.level, solve.parity);
    let mut remarks = Vec::new();
    let mut t = solve.start(start);
    let bounds_are_given = task.fall.is_none() && task.passage.is_none();
    let mut found = match bounds_are_given {
        true => solve.trapezoid(&mut t, FEW_STEPS)?,
        false => None,
    };
    let mut smooth = None;
    let mut failed_slips = None;
    if found.is_none() {
        let three_point = solve.three_point(&mut t)?;
        smooth = Some((solve.expand(&t), three_point.slip));
        found = solve.trapezoid(&mut t, STEPS_MAX)?;
        if found.is_none() {
            remarks.push(Remark::SecondRuleFailed {});
            failed_slips = Some(three_point.slips);
        }
    }
    let slips = found.or(failed_slips).unwrap_or_default();
    let mut traction = solve.expand(&t);
    let (second, slip) = match smooth {
        Some((second, slip)) => (Some(second), slip),
        None => (None, solve.own_slip()),
    };
    let slip = project_on_bound(&solve.bounds(), &slips, &mut traction, &slip);
    Ok(LevelAnswer {
        traction,
        second,
        slip,
        slips,
        work: solve.work,
        skip,
        remarks,
    })
}

/// The work that the symmetry of a mesh and a motion saves.
fn symmetry(level: &StripMesh, parity: Option<Parity>) -> Option<Skip> {
    match parity {
        Some(_) => Some(Skip::HalfTheCells),
        None => level.mirrored.then_some(Skip::HalfTheOperator),
    }
}

/// Replaces the slips of a solution by the smooth ones of the three-point rule and adds its tractions. Forces and zones do not change.
///
/// # Errors
/// See [`solve`].
pub fn smooth_slips(
    task: LevelTask,
    answer: &mut LevelAnswer,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<(), LevelFailure> {
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, workspace, monitor);
    let mut t = solve.start(Some(&answer.traction));
    let three_point = solve.three_point(&mut t)?;
    answer.second = Some(solve.expand(&t));
    // The tractions are within their bounds already and must not change by rounding.
    let mut same = answer.traction.clone();
    let bound = solve.bounds();
    answer.slip = project_on_bound(&bound, &answer.slips, &mut same, &three_point.slip);
    answer.work.add_lost(solve.work);
    Ok(())
}
