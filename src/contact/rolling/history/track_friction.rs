//! Friction that lies still on the track while the patch passes over it: bounds of the cells, step by step.

use crate::contact::friction::along::AlongLaw;
use crate::contact::rolling::history::level_run::LevelRun;
use crate::contact::rolling::history::plan::{HistoryStep, StepKind};
use crate::contact::rolling::history::task::HistoryTask;

/// What the bounds of the cells are taken from.
pub(super) struct TrackFriction {
    law: AlongLaw,
    /// Trailing and leading edge of each cell with unknowns in mm, when nothing has been rolled over.
    cells: Vec<[f64; 2]>,
    /// Bounds with the largest coefficient.
    largest: Vec<f64>,
}

impl HistoryTask {
    /// Distance in mm rolled since the start when a step ends.
    fn travelled(&self, step: &HistoryStep) -> f64 {
        let before = (step.point.checked_sub(1)).map_or(0.0, |k| self.distances[k]);
        match step.kind {
            StepKind::Roll { .. } => before + step.share * self.rolled(step.point),
            StepKind::Steady | StepKind::Press | StepKind::Shift => before,
        }
    }
}

impl LevelRun<'_> {
    /// The friction of the track, where it varies; bounds are still those of the largest coefficient.
    pub(super) fn track_friction(&self) -> Option<TrackFriction> {
        let mesh = &self.level.mesh;
        let edges = mesh.left.iter().zip(&mesh.right).take(self.cells);
        Some(TrackFriction {
            law: self.task.friction.along()?.clone(),
            cells: edges.map(|(left, right)| [*left, *right]).collect(),
            largest: self.bound.clone(),
        })
    }

    /// Takes the coefficients that lie under the cells when a step ends: rolling goes towards larger x.
    pub(super) fn lay_bounds(&mut self, step: &HistoryStep) {
        let Some(track) = &self.track else {
            return;
        };
        let travelled = self.history.travelled(step);
        let largest = track.law.largest();
        for ((bound, most), [left, right]) in
            self.bound.iter_mut().zip(&track.largest).zip(&track.cells)
        {
            let mean = track.law.mean(left + travelled, right + travelled);
            *bound = most * (mean / largest);
        }
    }

    /// Bounds of the last step over the whole mesh.
    pub(super) fn bounds_of_mesh(&self) -> Vec<f64> {
        match self.parity {
            Some(_) => self.level.unfold(&self.bound, 1.0),
            None => self.bound[..self.level.mesh.cells()].to_vec(),
        }
    }
}
