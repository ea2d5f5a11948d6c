//! The fast solver: projection form, semismooth Newton, strip-preconditioned GMRES.
//!
//! Every level is solved twice: with the three-point rule from the given start, then with the trapezoid rule from that solution.
//! Tractions, zones and forces are those of the trapezoid rule, whose resultants are more exact. The size of the slip is that of the
//! three-point rule, whose slips are smooth; its direction is that of the traction, as Coulomb's law demands. The difference of the
//! two rules is one of the indicators of the error.

use crate::contact::half_space::strip_operator::kind::Parity;
use crate::contact::monitor::Monitor;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::answer::{
    LevelAnswer, LevelExit, LevelFailure, Work, project_on_bound,
};
use crate::contact::rolling::methods::boundary_element::rule_sequence::{Control, RuleSequence};
use crate::contact::rolling::methods::boundary_element::task::{FEW_STEPS, LevelTask};
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::skip::Skip;
use crate::contact::rolling::start::Start;
use crate::contact::rolling::strip_mesh::StripMesh;

/// Solves one motion on one level, from a start or from zero tractions.
///
/// Bounds that fall with the slip are followed by the three-point rule, whose slips are smooth, and kept for the trapezoid rule: its own
/// slips alternate and would carry that into the bounds.
///
/// # Errors
/// [`LevelFailure::NotConverged`] if no start leads to a solution of the three-point rule; [`LevelFailure::Stopped`] if the
/// monitor stops the work. If only the trapezoid rule fails, the three-point tractions serve and a remark says so.
pub fn solve(
    task: LevelTask,
    start: Option<&Start>,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    if let Some(answer) = task.without_iteration() {
        return Ok(answer);
    }
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, Control { workspace, monitor });
    let mut skips = symmetry(task.level, solve.parity);
    let mut t = solve.start(start.map(|start| &start.three_point));
    let three_point = solve.three_point(&mut t, start.is_some())?;
    if three_point.by_fixed_point {
        skips.push(Skip::FullSlip);
    }
    let by_mirror = solve.expand(&t);
    let mut remarks = Vec::new();
    if let Some(force_change) = three_point.other {
        remarks.push(Remark::SeveralSolutions { force_change });
    }
    // The rules differ nearly as they do in the start.
    let warm = start.and_then(|start| {
        let [mut warm, before] =
            [start.trapezoid.as_ref()?, &start.three_point].map(|of| solve.start(Some(of)));
        let moves = t.iter().zip(before).map(|(now, before)| now - before);
        warm.iter_mut()
            .zip(moves)
            .for_each(|(warm, by)| *warm += by);
        Some(warm)
    });
    let (slips, second) = match solve.trapezoid(&mut t, warm)? {
        Some(slips) => (slips, Some(by_mirror)),
        None => {
            remarks.push(Remark::SecondRuleFailed {});
            (three_point.slips, None)
        }
    };
    let mut traction = solve.expand(&t);
    let bound = solve.bounds();
    let slip = project_on_bound(&bound, &slips, &mut traction, &three_point.slip);
    Ok(LevelAnswer {
        traction,
        second,
        slip,
        slips,
        exit: LevelExit::Solved,
        work: solve.work,
        skips,
        remarks,
    })
}

/// What the symmetry of a level and a motion saves.
fn symmetry(level: &StripMesh, parity: Option<Parity>) -> Vec<Skip> {
    if parity.is_some() {
        vec![Skip::HalfTheCells]
    } else if level.is_mirrored() {
        vec![Skip::HalfTheOperator]
    } else {
        Vec::new()
    }
}

/// Tractions of the trapezoid rule alone, from a start that is near; for the companions of a mesh. Where that takes many steps, and where
/// bounds fall with the slip, the three-point rule is solved first.
///
/// # Errors
/// [`LevelFailure::NotConverged`] if neither the start nor the upwind solution leads to a solution; [`LevelFailure::Stopped`] if the
/// monitor stops the work.
pub fn trapezoid(
    task: LevelTask,
    start: &[Vec<f64>; 2],
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<([Vec<f64>; 2], Work), LevelFailure> {
    if let Some(answer) = task.without_iteration() {
        return Ok((answer.traction, answer.work));
    }
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, Control { workspace, monitor });
    let mut t = solve.start(Some(start));
    let mut slips = None;
    if task.fall.is_none() && task.passage.is_none() {
        slips = solve.few_steps(&mut t, FEW_STEPS)?;
    }
    if slips.is_none() {
        solve.three_point(&mut t, true)?;
        slips = solve.trapezoid(&mut t, None)?;
    }
    let Some(slips) = slips else {
        return Err(LevelFailure::NotConverged {
            work: solve.work,
            tolerance: task.tolerance,
            advice: "try another mesh".to_owned(),
        });
    };
    let mut traction = solve.expand(&t);
    let none = [0, 1].map(|_| vec![0.0; slips.len()]);
    project_on_bound(&solve.bounds(), &slips, &mut traction, &none);
    Ok((traction, solve.work))
}

/// The trapezoid rule alone, from a start of its own, if that takes no more than `steps_max` steps, and the work. Slips are those of this rule, which alternate
/// from cell to cell ([`three_point_beside`] finds better ones).
///
/// # Errors
/// The monitor may stop the work.
pub fn trapezoid_of_motion(
    task: LevelTask,
    start: &[Vec<f64>; 2],
    steps_max: u32,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<(Option<LevelAnswer>, Work), LevelFailure> {
    if task.without_iteration().is_some() {
        return Ok((None, Work::default()));
    }
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, Control { workspace, monitor });
    let mut t = solve.start(Some(start));
    let Some(slips) = solve.few_steps(&mut t, steps_max)? else {
        return Ok((None, solve.work));
    };
    let mut traction = solve.expand(&t);
    let own = solve.own_slip();
    let slip = project_on_bound(&solve.bounds(), &slips, &mut traction, &own);
    let answer = LevelAnswer {
        traction,
        second: None,
        slip,
        slips,
        exit: LevelExit::Solved,
        work: solve.work,
        skips: symmetry(task.level, solve.parity),
        remarks: Vec::new(),
    };
    Ok((Some(answer), solve.work))
}

/// Adds the three-point rule to an answer of [`trapezoid_of_motion`], from tractions that differ from those of the answer by `apart`:
/// its tractions, and slips of its size.
///
/// # Errors
/// See [`solve`].
pub fn three_point_beside(
    task: LevelTask,
    answer: &mut LevelAnswer,
    apart: &[Vec<f64>; 2],
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<(), LevelFailure> {
    let operator = task.level.operator(monitor)?;
    let mut solve = RuleSequence::new(task, &operator, Control { workspace, monitor });
    let start = [0, 1].map(|k| {
        let pairs = answer.traction[k].iter().zip(&apart[k]);
        pairs.map(|(t, apart)| t + apart).collect()
    });
    let mut t = solve.start(Some(&start));
    let three_point = solve.three_point(&mut t, true)?;
    answer.second = Some(solve.expand(&t));
    // The tractions are within their bounds already, and are to stay as they are to the last bit.
    let mut same = answer.traction.clone();
    let bound = solve.bounds();
    answer.slip = project_on_bound(&bound, &answer.slips, &mut same, &three_point.slip);
    answer.work.add_lost(solve.work);
    Ok(())
}
