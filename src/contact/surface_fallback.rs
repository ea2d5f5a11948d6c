//! Falls back to planes of contact if a case does not choose the reference surface and the curve of the rail has no answer.

use std::sync::Arc;

use crate::error::SolveError;
use crate::monitor::Monitor;
use crate::normal::wheel::WheelTask;
use crate::problem::checked_case::CheckedCase;
use crate::profile_assessment::trust;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// Solves a wheel on its reference surface, or on planes if the curve has no answer and the case does not ask for it.
///
/// Several motions are all solved on planes if the wheel without tractions has no equilibrium on the curve, so that each part of a sweep makes the
/// same choice. A history has no parts.
///
/// # Errors
/// Returns the error of `solve` on the surface that was tried last.
pub(crate) fn solve_wheel<T>(
    case: &CheckedCase,
    contact: &WheelTask,
    monitor: &dyn Monitor,
    solve: impl Fn(&CheckedCase, &WheelTask) -> Result<T, SolveError>,
) -> Result<(T, Option<RemarkEntry>), SolveError> {
    let error = match solve(case, contact) {
        Ok(found) => return Ok((found, None)),
        Err(error) => error,
    };
    let CheckedCase { problem, .. } = case;
    let several = problem.part.all > 1 && problem.history.is_none();
    let error = match several && contact.may_fall_back() {
        true => match trust::comes_to_rest(case, contact, monitor) {
            Ok(()) => return Err(error),
            Err(error) => error,
        },
        false => error,
    };
    let remark = fallback(contact, error)?;
    let planes = contact.on_planes();
    let case = CheckedCase {
        problem: case.problem.with_wheel(Arc::new(planes.clone())),
        ..case.clone()
    };
    Ok((solve(&case, &planes)?, Some(remark)))
}

/// The remark that planes were used instead of the curve.
///
/// # Errors
/// Returns the given error if planes are no alternative, because the case asks for its surface or the work was stopped.
pub(crate) fn fallback(contact: &WheelTask, error: SolveError) -> Result<RemarkEntry, SolveError> {
    let of_surface = matches!(
        error,
        SolveError::NormalProblem { .. }
            | SolveError::NotConverged { .. }
            | SolveError::Unmeshable { .. }
    );
    if !of_surface || !contact.may_fall_back() {
        return Err(error);
    }
    let reason = format!("on the curve of the rail, {error}");
    Ok(Remark::OnPlanes { reason }.into())
}
