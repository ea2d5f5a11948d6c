//! What a case will cost, estimated before it is queued: memory from its finest mesh (`size.rs`), time from its motions (`solve_time.rs`).

use crate::contact::case::problem::CheckedCase;
use crate::contact::case::size::{SizeInput, length_over_width, positions, segments};
use crate::contact::post::subsurface::task::SubsurfaceTask;

impl CheckedCase {
    /// Estimated cost of solving this: the operator of the finest mesh and what stands beside it, the matrices of the dense method,
    /// the answer. What the process keeps for all cases, the operator store, comes on top. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost {
            bytes: self.size_input().bytes() as u64,
            seconds: self.solve_time().whole,
        }
    }

    /// What decides how much memory this takes.
    pub(crate) fn size_input(&self) -> SizeInput {
        let places = |task: &SubsurfaceTask| task.places.count();
        SizeInput {
            method: self.run.method,
            resolution: self.run.resolution,
            segments: segments(&self.problem.task),
            motions: self.problem.motions.len() * positions(&self.problem.task),
            history: self.problem.history.is_some(),
            fields: self.run.outputs.iter().any(|output| output.is_per_cell()),
            stress_points: self.run.after.subsurface.as_ref().map_or(0, places),
            ellipse: length_over_width(&self.problem.task),
        }
    }
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}
