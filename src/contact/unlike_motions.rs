//! The motions of bodies that differ: each has a region and a pressure of its own, because its tractions change them.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::normal_stage::SolvedFootprint;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling_stage;
use crate::contact::solution::words::answer::{MotionRegion, PatchSolution, Solution};
use crate::contact::solution::words::fields::Fields;
use crate::contact::time_limit::TimeLimit;
use crate::contact::unlike_bodies::UnlikeGap;

/// Solves every motion of a case in a gap; region and pressure of each are sought from those of the motion before. The patches of the answer
/// are those of the first motion; where a case has several, their points say what belongs to each.
///
/// # Errors
/// Why a motion has no answer; or the monitor stopped the work.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    gap: &UnlikeGap,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let several = case.problem.part.all > 1;
    let mut neighbour: Option<SolvedFootprint> = None;
    let mut answer: Option<(Solution, Fields)> = None;
    for index in 0..case.problem.motions.len() {
        let part = case.slice(index..index + 1);
        let solved = gap
            .solve(operators, &part, neighbour.as_ref(), watch)
            .map_err(|error| watch.explained(error, &part))?;
        let solved = if several {
            with_patches_of(gap, solved, &part)
        } else {
            solved
        };
        let (mut solution, fields) = rolling_stage::solve(operators, &part, &solved, watch)?;
        if several {
            solution.patches.iter_mut().for_each(tell_region);
        }
        match &mut answer {
            None => answer = Some((solution, fields)),
            Some((all, all_fields)) => {
                all.append(solution);
                all_fields.append(fields);
            }
        }
        neighbour = Some(solved);
    }
    let Some(answer) = answer else {
        unreachable!("a case has at least one motion")
    };
    Ok(answer)
}

/// The contact of a motion, with as many patches as that without tractions: an answer has one list of patches. Where tractions part or join
/// them, the motion is answered on the patches without tractions, and a remark says so.
fn with_patches_of(
    gap: &UnlikeGap,
    solved: SolvedFootprint,
    part: &CheckedCase,
) -> SolvedFootprint {
    let count = |solved: &SolvedFootprint| solved.footprint.patches().len();
    let number = part.problem.part.before;
    let seconds = solved.report.map_or(0.0, |report| report.seconds);
    let mut kept = solved;
    if count(&kept) != count(&gap.without) {
        kept = gap.without.clone();
        kept.coupling_error = part.problem.first_order_error(part.run.method);
        let remark = part.problem.first_order_remark(part.run.method);
        kept.remarks.push(remark.into());
    }
    if let Some(report) = &mut kept.report {
        report.seconds = seconds;
    }
    kept.remarks
        .iter_mut()
        .for_each(|remark| remark.point = Some(number));
    kept
}

/// Writes region and pressure of the one motion of a patch into its point.
pub(crate) fn tell_region(patch: &mut PatchSolution) {
    let region = MotionRegion {
        normal_force_n: patch.normal_force_n,
        friction_limit_n: patch.friction_limit_n,
        approach_mm: patch.approach_mm,
        area_mm2: patch.area_mm2,
        pressure_max_mpa: patch.pressure_max_mpa,
        extent_mm: patch.extent_mm,
    };
    for point in &mut patch.points {
        point.region = Some(Box::new(region));
    }
}
