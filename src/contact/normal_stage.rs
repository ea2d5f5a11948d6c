//! The stage of the normal problem: computes region and pressure of a contact whose patches share one frame.

use crate::error::SolveError;
use crate::half_space::bent_surface::BentWorkspace;
use crate::monitor::Monitor;
use crate::normal::footprint::{Footprint, NormalTask};
use crate::normal::gap::grid::{GridFineness, NormalError, NormalWork};
use crate::normal::gap::task::GapTask;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::RemarkEntry;
use crate::solution::words::answer::NormalReport;

/// The solved normal problem of one frame.
#[derive(Debug, Clone)]
pub struct SolvedFootprint {
    /// Patches and pressures.
    pub footprint: Footprint,
    /// How they were computed, unless they were known beforehand.
    pub report: Option<NormalReport>,
    /// Error of forces relative to μN because the pressures neglect the tractions or include those of an earlier iteration.
    pub coupling_error: f64,
    /// Remarks on patches and pressures.
    pub remarks: Vec<RemarkEntry>,
}

/// Returns patches and pressures of a checked case. They are known from the case or computed for a gap.
///
/// # Errors
/// The normal problem has no solution, the tangential problem needs too much memory, or the monitor stopped the work.
///
/// # Panics
/// For a wheel, whose patches have separate frames: see [`wheel_on_rail`](crate::wheel_on_rail).
pub fn solve(case: &CheckedCase, monitor: &dyn Monitor) -> Result<SolvedFootprint, SolveError> {
    let first_order_error = case.problem.first_order_error(case.run.method);
    let known = |footprint, coupling_error| SolvedFootprint {
        footprint,
        report: None,
        coupling_error,
        remarks: Vec::new(),
    };
    match &case.problem.task {
        NormalTask::Hertz(ellipse) => Ok(known(Footprint::hertz(*ellipse), first_order_error)),
        NormalTask::Given(field) => Ok(known(Footprint::given(field.clone()), first_order_error)),
        NormalTask::Gap(task) => {
            let began = monitor.elapsed();
            let workspace = &mut BentWorkspace::default();
            let fineness = GridFineness::for_answer(case.run.target());
            let mut found = solve_gap(case, task, fineness, workspace, monitor)?;
            found.coupling_error = first_order_error;
            found.report = found.report.map(|report| NormalReport {
                seconds: monitor.elapsed().saturating_sub(began).as_secs_f64(),
                ..report
            });
            Ok(found)
        }
        NormalTask::Wheel(_) | NormalTask::Wheelset(_) => {
            unreachable!("the patches of a wheel have separate frames")
        }
    }
}

/// Computes patches and pressures of a gap on grids of a given fineness, and checks the memory limit. Coupling error and time are 0.
///
/// # Errors
/// See [`solve`].
pub(crate) fn solve_gap(
    case: &CheckedCase,
    task: &GapTask,
    fineness: GridFineness,
    workspace: &mut BentWorkspace,
    monitor: &dyn Monitor,
) -> Result<SolvedFootprint, SolveError> {
    let found = task.solve_as(fineness, workspace, monitor)?;
    let solved = SolvedFootprint {
        footprint: Footprint::computed(found.field, 0.0, found.report.residual),
        report: Some(found.report.with_time(0.0)),
        coupling_error: 0.0,
        remarks: found.remarks,
    };
    case.fits(&solved.footprint)?;
    Ok(solved)
}

impl From<NormalError> for SolveError {
    fn from(failure: NormalError) -> Self {
        match failure {
            NormalError::Stopped(stop) => stop.into(),
            NormalError::NoAnswer(reason) => SolveError::NormalProblem { reason },
        }
    }
}

impl NormalWork {
    /// Converts the report to that of an answer, with the wall time in s.
    pub fn with_time(self, seconds: f64) -> NormalReport {
        NormalReport {
            cells: self.cells.map(|n| u32::try_from(n).unwrap_or(u32::MAX)),
            iterations: self.iterations,
            residual: self.residual,
            grids: u32::try_from(self.grids).unwrap_or(u32::MAX),
            pressure_change: self.pressure_change,
            force_residual: 0.0,
            seconds,
        }
    }
}
