//! Finds region and pressure where a case gives a gap, and asks on for one patch of many.

use std::borrow::Cow;

use crate::contact::case::problem::{Problem, Resolution};
use crate::contact::case::words::Motion;
use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::solve::{Failure, Report};
use crate::contact::normal::region::Region;
use crate::contact::solution::words::NormalReport;

impl Problem {
    /// The problem with region and pressure known; solves the normal problem if they are not.
    ///
    /// # Errors
    /// Why there is no region and pressure; or the monitor stopped the work.
    pub fn pressed(&self, monitor: &dyn Monitor) -> Result<Cow<'_, Problem>, SolveError> {
        let Region::Gap(contact) = &self.region else {
            return Ok(Cow::Borrowed(self));
        };
        let began = monitor.elapsed();
        let found = contact.solve_for(self.target(), monitor)?;
        let mut problem = self.clone();
        problem.region = Region::Grid(found.field);
        problem.remarks.extend(found.remarks);
        let seconds = (monitor.elapsed() - began).as_secs_f64();
        problem.normal = Some(found.report.with_time(seconds));
        problem.fits()?;
        Ok(Cow::Owned(problem))
    }

    /// Target of the resultants' error relative to μN; infinite where a mesh is given.
    #[must_use]
    pub fn target(&self) -> f64 {
        match self.resolution {
            Resolution::Target(target) => target,
            Resolution::Mesh(_) => f64::INFINITY,
        }
    }

    /// The same question about a part of the contact whose region, pressure and motions are known; without remarks.
    ///
    /// # Errors
    /// The part needs more memory than is allowed.
    pub fn of_part(
        &self,
        region: Region,
        motions: Vec<Motion>,
        normal: NormalReport,
        load_error: f64,
    ) -> Result<Problem, SolveError> {
        let part = Problem {
            region,
            motions,
            wheelset: None,
            remarks: Vec::new(),
            normal: Some(normal),
            load_error,
            ..self.clone()
        };
        part.fits().map(|()| part)
    }

    /// Does a solve stay within the memory allowed? How many patches and segments there are is known only when they are
    /// found.
    fn fits(&self) -> Result<(), SolveError> {
        let bytes = self.cost().bytes;
        if bytes > self.memory_bytes {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "the contact falls apart into {} patches with {:.1} segments per strip, which need about {} MiB; at \
                     most {} MiB are allowed for one case",
                    self.region.patches().len(),
                    self.region.segments_per_strip().iter().sum::<f64>(),
                    bytes >> 20,
                    self.memory_bytes >> 20
                ),
            });
        }
        Ok(())
    }
}

impl From<Failure> for SolveError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Stopped(stop) => stop.into(),
            Failure::NoAnswer(reason) => SolveError::NormalProblem { reason },
        }
    }
}

impl Report {
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
