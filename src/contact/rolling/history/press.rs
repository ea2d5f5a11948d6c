//! The state in which pressing leaves bodies that differ, step by step of a growing patch (Spence 1968, 1975).
//!
//! A step lets the patch grow by the factor ρ. Slip over it is minus the change of the displacements U at a fixed place, of which the
//! backward difference of second order in the logarithm of the size is `3/2 U(x) − 2 ρ⁻² U(ρx) + 1/2 ρ⁻⁴ U(ρ²x)`. Steps are taken until the tractions are the scaled
//! copy of those before; what the first of them began with is then forgotten.
//!
//! How the steps of a run take part in friction that falls with slip.

use std::ops::ControlFlow;

use crate::contact::friction::velocity_weakening::Softening;
use crate::contact::half_space::unlike_bodies::displacement;
use crate::contact::rolling::answer::LevelFailure;
use crate::contact::rolling::history::level_run::LevelRun;
use crate::contact::rolling::history::plan::{PRESS_WEIGHTS, StepEquations, StepKind};
use crate::contact::rolling::history::self_similar::{PressedPair, PressedState, SelfSimilarState};
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::slip_equations::{SlipEquations, SlipScratch};
use crate::contact::rolling::task::Motion;

// The numbers below were chosen on the three contacts of `tests/physics/pressing.rs`; what others give was not measured.

/// Growth of the patch in a step.
const GROWTH: f64 = 1.05;
/// Steps at most; 100 shrink what a step began with by 130.
const STEPS_MAX: usize = 300;
/// Mean change of the tractions in a step, relative to the friction limit, from which on they count as copies. 1e-6 gives the same forces and areas.
const CHANGE: f64 = 2e-5;
/// From this step on the mean of two states is taken for the past, since single cells at the edge of what sticks may come and go for ever
/// where nearly all sticks.
const STEPS_FREE: usize = 60;
/// After so many steps a change of this is taken too.
const STEPS_LATE: usize = 160;
/// See [`STEPS_LATE`].
const CHANGE_LATE: f64 = 3e-4;
/// Energies grow with this power of the size.
const ENERGY_POWER: f64 = 5.0;

impl LevelRun<'_> {
    /// Tractions of bodies that were pressed together.
    ///
    /// # Errors
    /// A step did not converge, or the monitor stopped the work.
    pub(super) fn press(&mut self, of: &StepEquations) -> Result<(), LevelFailure> {
        let (level, cells) = (self.level, self.cells);
        let mesh = &level.normalised;
        let difference = self.task.elasticity.difference;
        let unit = self.task.interface.reduction / level.scale.traction;
        let pressure: Vec<f64> = level.pressure.iter().map(|p| p * unit).collect();
        let pair = PressedPair {
            poisson_ratio: level.poisson_ratio(),
            difference,
            pressure: &pressure,
        };
        let centre = level.scale.origin.map(|x| -x / level.scale.length);
        let smaller = [GROWTH, GROWTH * GROWTH]
            .map(|factor| SelfSimilarState::new(mesh, &pair, centre, factor, cells));
        let rows = mesh.segments.iter().flat_map(|s| {
            let y = s.chord.y;
            s.cells.clone().map(move |i| [mesh.node[i], y])
        });
        let given: Vec<[f64; 2]> = rows
            .map(|at| displacement(mesh, difference, &pressure, at))
            .collect();
        // From nothing at once to begin with.
        let mut past: Option<[PressedState; 2]> = None;
        let mut change = f64::INFINITY;
        for step in 0..STEPS_MAX {
            if let ControlFlow::Break(stop) = self.monitor.tick(0.0) {
                return Err(stop.into());
            }
            let mut source =
                [0, 1].map(|k| given.iter().map(|u| -PRESS_WEIGHTS[0] * u[k]).collect());
            if let Some(past) = &past {
                for ((state, smaller), weight) in past.iter().zip(&smaller).zip(&PRESS_WEIGHTS[1..])
                {
                    add(&mut source, &smaller.displacements(state), *weight);
                }
            }
            let tractions = self.solve(of, &Motion::default(), &source)?;
            change = self.mean_change(&tractions);
            let state = self.pressed(of, &tractions, &given);
            past = Some(match past {
                None => [state.clone(), state],
                Some([last, _]) if step < STEPS_FREE => [state, last],
                // What comes and goes from step to step is taken out.
                Some([last, _]) => {
                    let mean = state.mean(&last);
                    [mean.clone(), mean]
                }
            });
            self.state.tractions = tractions;
            if change < CHANGE && step > 1 || change < CHANGE_LATE && step > STEPS_LATE {
                self.settle(of);
                return Ok(());
            }
        }
        Err(LevelFailure::NotConverged {
            work: self.state.work,
            tolerance: CHANGE,
            advice: format!(
                "tractions still change by {change:.1e} of the friction limit in a step of growth; try another mesh"
            ),
        })
    }

    /// Mean of what tractions have more than those of the state, over the friction limit.
    fn mean_change(&self, tractions: &[f64]) -> f64 {
        let before = &self.state.tractions;
        let change: Vec<f64> = tractions.iter().zip(before).map(|(t, b)| t - b).collect();
        self.mean(&change)
    }

    /// Mean length of tractions over the friction limit.
    pub(super) fn mean(&self, tractions: &[f64]) -> f64 {
        let half = tractions.len() / 2;
        let of_cell = |i: usize| self.area[i] * tractions[i].hypot(tractions[half + i]);
        (0..self.cells).map(of_cell).sum::<f64>() / self.limit
    }

    /// The state of tractions and of displacements that pressures give.
    fn pressed(&self, of: &StepEquations, tractions: &[f64], given: &[[f64; 2]]) -> PressedState {
        let mut own = vec![0.0; tractions.len()];
        of.equations
            .displacement(tractions, &mut own, &mut SlipScratch::default());
        let mut displacement = self.expand(&own);
        for (k, displacement) in displacement.iter_mut().enumerate() {
            let both = displacement.iter_mut().zip(given);
            both.for_each(|(u, given)| *u += given[k]);
        }
        PressedState {
            displacement,
            traction: self.expand(tractions),
        }
    }

    /// What the state remembers once it is found: friction took a fifth of the power that it takes per growth.
    fn settle(&mut self, of: &StepEquations) {
        let mut displacement = vec![0.0; self.state.tractions.len()];
        let mut scratch = SlipScratch::default();
        of.equations
            .displacement(&self.state.tractions, &mut displacement, &mut scratch);
        let slip = self.workspace.slip().to_vec();
        let length = self.level.scale.length;
        let over = self.per_patch(&self.state.tractions, &slip);
        let stored = self.per_patch(&self.state.tractions, &displacement);
        let state = &mut self.state;
        state.motion = Motion::default();
        for patch in 0..over.len() {
            let per_growth = length * over[patch] / GROWTH.ln();
            state.dissipated[patch] = (per_growth / ENERGY_POWER).max(0.0);
            state.stored[patch] = [0.5 * length * stored[patch]; 2];
        }
        state.earlier.clone_from(&displacement);
        state.displacement = displacement;
    }
}

/// Adds values with a weight.
fn add(sum: &mut [Vec<f64>; 2], values: &[Vec<f64>; 2], weight: f64) {
    for (sum, values) in sum.iter_mut().zip(values) {
        sum.iter_mut()
            .zip(values)
            .for_each(|(sum, value)| *sum += weight * value);
    }
}

impl LevelRun<'_> {
    /// The fall that a step follows at once.
    pub(super) fn fall(&self, kind: StepKind) -> Option<Softening> {
        self.slip_friction.as_ref()?.at_once(kind)
    }

    /// A solver of such a step.
    pub(super) fn newton<'e>(
        &self,
        kind: StepKind,
        equations: &'e SlipEquations<'e>,
    ) -> Newton<'e> {
        let newton = Newton::new(equations);
        match self.fall(kind) {
            Some(fall) => newton.falling(&self.bound, &fall),
            None => newton,
        }
    }

    /// Lets bounds that fall with slip follow the slips of a step.
    pub(super) fn follow_slips(&mut self, of: &StepEquations) {
        let Some(friction) = &mut self.slip_friction else {
            return;
        };
        let slip = self.workspace.slip();
        let half = slip.len() / 2;
        let slides = |i: usize| of.newton.slips(&self.bound, &self.state.tractions, slip, i);
        let size = |i: usize| match slides(i) {
            true => slip[i].hypot(slip[half + i]),
            false => 0.0,
        };
        let sizes: Vec<f64> = (0..self.cells).map(size).collect();
        friction.follow(of.kind, &sizes);
        if of.kind == StepKind::Steady {
            self.bound.copy_from_slice(friction.settled());
        }
    }
}
