//! Finds region and pressure where a case gives a gap, and asks on for one patch of many.

use std::borrow::Cow;

use crate::contact::case::problem::Problem;
use crate::contact::error::SolveError;
use crate::contact::friction::law::FrictionLaw;
use crate::contact::monitor::Monitor;
use crate::contact::normal::answer::{NormalError, NormalWork};
use crate::contact::normal::footprint::Footprint;
use crate::contact::normal::region::Region;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::resolution::Resolution;
use crate::contact::rolling::task::RollingTask;
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

    /// The solved normal problem.
    ///
    /// # Panics
    /// If region and pressure are not known yet.
    #[must_use]
    pub fn footprint(&self) -> Footprint {
        match &self.region {
            Region::Ellipse(ellipse) => Footprint::hertz(*ellipse),
            Region::Grid(field) if self.normal.is_some() => {
                Footprint::computed(field.clone(), self.load_error)
            }
            Region::Grid(field) => Footprint::given(field.clone()),
            Region::Gap(_) | Region::Profiles(_) => unreachable!("the normal problem is solved"),
        }
    }

    /// What is asked of the tangential problem on a footprint.
    #[must_use]
    pub fn rolling_task<'a>(&'a self, footprint: &'a Footprint) -> RollingTask<'a> {
        RollingTask {
            footprint,
            elasticity: &self.elasticity,
            friction: FrictionLaw::Constant(self.friction),
            motions: &self.motions,
            forces: &self.forces,
            first_motion: self.part.before,
            single_motion: self.part.all == 1,
            method: self.method,
            traction_bound: self.traction_bound,
            resolution: self.resolution,
        }
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
