//! Finds region and pressure where a case gives a gap.

use std::borrow::Cow;

use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::normal::Region;
use crate::contact::normal::non_hertzian::Failure;
use crate::contact::problem::Problem;
use crate::contact::solution::NormalReport;

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
        let found = contact.solve(monitor).map_err(|failure| match failure {
            Failure::Stopped(stop) => stop.into(),
            Failure::NoAnswer(reason) => SolveError::NormalProblem { reason },
        })?;
        let mut problem = self.clone();
        problem.region = Region::Grid(found.field);
        problem.warnings.extend(found.warnings);
        problem.normal = Some(NormalReport {
            cells: found
                .report
                .cells
                .map(|n| u32::try_from(n).unwrap_or(u32::MAX)),
            iterations: found.report.iterations,
            residual: found.report.residual,
            seconds: (monitor.elapsed() - began).as_secs_f64(),
        });
        // How many patches and segments there are is known only now.
        let bytes = problem.cost().bytes;
        if bytes > self.memory_bytes {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "the contact falls apart into {} patches with {:.1} segments per strip, which need about {} MiB; at \
                     most {} MiB are allowed for one case",
                    problem.region.patches().len(),
                    problem.region.segments_per_strip().iter().sum::<f64>(),
                    bytes >> 20,
                    self.memory_bytes >> 20
                ),
            });
        }
        Ok(Cow::Owned(problem))
    }
}
