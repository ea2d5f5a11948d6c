//! The stage of the normal problem: a contact whose patches have one frame gets its region and pressure.

use crate::error::SolveError;
use crate::half_space::grid_operator::GridWorkspace;
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
    /// How they were found, where they were not known beforehand.
    pub report: Option<NormalReport>,
    /// Error of forces relative to μN because the pressures were found without, or with earlier, tractions.
    pub coupling_error: f64,
    /// Remarks on them.
    pub remarks: Vec<RemarkEntry>,
}

/// Patches and pressures of a checked case: known from the case, or found for a gap.
///
/// # Errors
/// Why there are none, or why the tangential problem on them needs too much memory; or the monitor stopped the work.
///
/// # Panics
/// On a wheel, whose patches have a frame each: see [`wheel_on_rail`](crate::wheel_on_rail).
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
            let workspace = &mut GridWorkspace::default();
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
            unreachable!("the patches of a wheel have a frame each")
        }
    }
}

/// Patches and pressures of a gap on grids as fine as told, checked against the memory allowed;
/// coupling error and time are left 0.
///
/// # Errors
/// As [`solve`].
pub(crate) fn solve_gap(
    case: &CheckedCase,
    task: &GapTask,
    fineness: GridFineness,
    workspace: &mut GridWorkspace,
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
    /// The report as the client reads it, with the wall time in s.
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
