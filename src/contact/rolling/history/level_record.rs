//! Results of a step: friction work, elastic energy, and the record of a point.

use crate::rolling::answer::{Resultants, project_on_bound};
use crate::rolling::history::level_run::LevelRun;
use crate::rolling::history::plan::{PointRecord, StepEquations, StepKind, weights};
use crate::rolling::slip_equations::SlipSource;
use crate::rolling::task::Motion;

impl LevelRun<'_> {
    /// Adds the energy that friction has dissipated in a step that began with the tractions and the motion `from`: the work of the motion minus the stored energy.
    ///
    /// The power summed over the cells, `∬T·s`, would be several per cent too small: in steady rolling its error is that of the slip at the trailing edge, while ν·F
    /// is as accurate as the forces. A shift has no such slip, and the sum is used.
    pub(super) fn dissipate(&mut self, of: &StepEquations, (tractions, motion): (&[f64], Motion)) {
        let rigid = self.rigid(of, &self.state.motion);
        let rigid_before = match of.kind {
            StepKind::Roll { growth, .. } if growth > 0.0 => &self.rigid(of, &motion),
            // A sequence begins with the motion of its first step, which is short.
            _ => &rigid,
        };
        let slip = self.workspace.slip().to_vec();
        let [before, now, over] = [
            self.per_patch(tractions, rigid_before),
            self.per_patch(&self.state.tractions, &rigid),
            self.per_patch(&self.state.tractions, &slip),
        ];
        let stored = self.per_patch(&self.state.tractions, &self.state.displacement);
        let length = self.level.scale.length;
        let state = &mut self.state;
        for patch in 0..state.power.len() {
            let [last, earlier] = state.stored[patch];
            let stored = 0.5 * length * stored[patch];
            let (power, dissipated) = match of.kind {
                StepKind::Steady => (now[patch], 0.0),
                StepKind::Shift | StepKind::Press => (0.0, length * over[patch]),
                StepKind::Roll { distance, growth } => {
                    let [a, b, c] = weights(growth);
                    let growing = (a * stored - b * last + c * earlier) / distance;
                    let given = 0.5 * distance * (before[patch] + now[patch]);
                    (now[patch] - growing, given - (stored - last))
                }
            };
            // The error of the mesh may be negative where almost nothing slips.
            state.power[patch] = power.max(0.0);
            state.dissipated[patch] += dissipated.max(0.0);
            state.stored[patch] = match of.kind {
                StepKind::Steady => [stored, stored],
                _ => [stored, last],
            };
        }
    }

    /// Rigid slip of a dimensionless motion, with the slip of the surface if the bodies roll.
    pub(super) fn rigid(&self, of: &StepEquations, motion: &Motion) -> Vec<f64> {
        let rolls = matches!(of.kind, StepKind::Steady | StepKind::Roll { .. });
        let source = self.level.surface_slip.as_ref().filter(|_| rolls);
        let source = source.map(|[x, y]| SlipSource { x, y });
        let mut rigid = of.equations.given(motion, source);
        if let Some(by_motion) = &self.level.slip_by_motion {
            let motion = self.level.scale.creepages(motion);
            let shares = [motion.creepage_y, motion.spin_per_mm];
            for (slips, share) in by_motion.iter().zip(shares) {
                let slips = slips
                    .each_ref()
                    .map(|slips| slips.iter().map(|slip| share * slip).collect());
                self.add_to_cells(&mut rigid, slips.each_ref());
            }
        }
        rigid
    }

    /// Adds values of the cells, along x and across, to the unknowns.
    pub(super) fn add_to_cells(&self, unknowns: &mut [f64], values: [&Vec<f64>; 2]) {
        let half = unknowns.len() / 2;
        for (unknowns, values) in unknowns.chunks_exact_mut(half).zip(values) {
            let cells = unknowns.iter_mut().zip(values).take(self.cells);
            cells.for_each(|(unknown, value)| *unknown += value);
        }
    }

    /// `∬a·b` over each patch in N for a traction `a` and a slip `b`, both dimensionless values of the unknowns.
    pub(super) fn per_patch(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let [a, b] = [a, b].map(|values| self.expand(values));
        let level = self.level;
        let unit = level.scale.traction * level.scale.slip();
        let of_cell = |i: usize| level.area[i] * (a[0][i] * b[0][i] + a[1][i] * b[1][i]);
        let patches = 0..self.state.power.len();
        patches
            .map(|patch| unit * level.patch_cells(patch).map(of_cell).sum::<f64>())
            .collect()
    }

    /// The record of the state after the last step.
    pub(super) fn record(&mut self, of: &StepEquations) -> PointRecord {
        let level = self.level;
        let slip = self.workspace.slip();
        let tractions = &self.state.tractions;
        let slips = of.newton.zones(&self.bound, tractions, slip, level);
        let mut traction = self.expand(&self.state.tractions);
        let mut slip = self.expand(slip);
        let bound = level.whole(self.parity, &self.bound);
        slip = project_on_bound(&bound, &slips, &mut traction, &slip);
        let scale = level.scale;
        let motion = self.state.motion;
        let (shifted, motion) = match of.kind {
            StepKind::Shift | StepKind::Press => {
                // Displacements are not slips.
                slip.iter_mut().for_each(|slip| slip.fill(0.0));
                (scale.shift(&motion), Motion::default())
            }
            _ => (Motion::default(), scale.creepages(&motion)),
        };
        let patches = 0..self.state.power.len();
        PointRecord {
            motion,
            shift: shifted,
            resultants: patches
                .map(|patch| Resultants::of_patch(level, &traction, patch))
                .collect(),
            power: self.state.power.clone(),
            dissipated: self.state.dissipated.clone(),
            carried: self.mean(&self.state.tractions),
            elastic: self.state.stored.iter().map(|[now, _]| now).sum(),
            traction,
            slip,
            slips,
            saturated: std::mem::take(&mut self.state.saturated),
            work: std::mem::take(&mut self.state.work),
        }
    }

    /// Expands values of the unknowns to the whole mesh.
    pub(super) fn expand(&self, values: &[f64]) -> [Vec<f64>; 2] {
        self.level.expand(self.parity, values)
    }
}
