//! From question to footprint: finds patches and pressures where a case gives a gap.

use crate::contact::case::problem::CheckedCase;
use crate::contact::case::size::SizeInput;
use crate::contact::error::SolveError;
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::answer::{NormalError, NormalWork};
use crate::contact::normal::footprint::Footprint;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::rolling::task::RollingTask;
use crate::contact::solution::words::NormalReport;

/// The solved normal problem of one frame.
#[derive(Debug, Clone)]
pub struct PressedContact {
    /// Patches and pressures.
    pub footprint: Footprint,
    /// How they were found, where they were not known beforehand.
    pub report: Option<NormalReport>,
    /// Error of forces relative to μN that pressures leave because they do not quite belong to the tractions.
    pub coupling_error: f64,
    /// Remarks on them.
    pub remarks: Vec<RemarkEntry>,
}

impl CheckedCase {
    /// Patches and pressures; of a gap they are found.
    ///
    /// # Errors
    /// Why there are none, or why the tangential problem on them needs too much memory; or the monitor stopped the work.
    ///
    /// # Panics
    /// On a wheel, whose patches have a frame each: see [`stages`](crate::contact::stages).
    pub fn pressed(&self, monitor: &dyn Monitor) -> Result<PressedContact, SolveError> {
        let coupling_error = self.problem.first_order_error(self.run.method);
        let known = |footprint| PressedContact {
            footprint,
            report: None,
            coupling_error,
            remarks: Vec::new(),
        };
        let task = match &self.problem.task {
            NormalTask::Hertz(ellipse) => return Ok(known(Footprint::hertz(*ellipse))),
            NormalTask::Given(field) => return Ok(known(Footprint::given(field.clone()))),
            NormalTask::Gap(task) => task,
            NormalTask::Wheel(_) | NormalTask::Wheelset(_) => {
                unreachable!("a wheel is brought to rest first")
            }
        };
        let began = monitor.elapsed();
        let found = task.solve_for(self.run.target(), &mut GridWorkspace::default(), monitor)?;
        let seconds = (monitor.elapsed() - began).as_secs_f64();
        let pressed = PressedContact {
            footprint: Footprint::computed(found.field, 0.0),
            report: Some(found.report.with_time(seconds)),
            coupling_error,
            remarks: found.remarks,
        };
        self.fits(&pressed.footprint)?;
        Ok(pressed)
    }

    /// What is asked of the tangential problem on a footprint.
    #[must_use]
    pub fn rolling_task<'a>(&'a self, footprint: &'a Footprint) -> RollingTask<'a> {
        let CheckedCase { problem, run, .. } = self;
        RollingTask {
            footprint,
            elasticity: &problem.elasticity,
            friction: &problem.friction,
            interface: problem.interface,
            motions: &problem.motions,
            forces: &problem.forces,
            speeds: &problem.speeds,
            first_motion: problem.part.before,
            single_motion: problem.part.all == 1,
            method: run.method,
            traction_bound: run.traction_bound,
            resolution: run.resolution,
        }
    }

    /// Checks that a solve stays within the memory allowed, once the number of patches and segments is known.
    ///
    /// # Errors
    /// The solve needs more memory.
    pub(crate) fn fits(&self, footprint: &Footprint) -> Result<(), SolveError> {
        let segments = footprint.segments_per_strip();
        let (patches, sum) = (footprint.patches().len(), segments.iter().sum::<f64>());
        let bytes = SizeInput {
            segments,
            ellipse: None,
            ..self.size_input()
        }
        .bytes() as u64;
        if bytes > self.run.memory_bytes {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "the contact falls apart into {patches} patches with {sum:.1} segments per strip, which need about {} MiB; at \
                     most {} MiB are allowed for one case",
                    bytes >> 20,
                    self.run.memory_bytes >> 20
                ),
            });
        }
        Ok(())
    }
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
    #[must_use]
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
