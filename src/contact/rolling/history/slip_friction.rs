//! Friction that falls with slip while the motion changes: bounds that follow the slips of the steps before within a short distance.
//!
//! Bounds that fell with the slip of the same moment would leave a history without a definite answer: without inertia every disturbance
//! grows, the faster the shorter it is (Rice, Lapusta and Ranjith 2001), and steps short enough have several solutions each. Here the bound g
//! of a cell follows `dg/dq = (μ(s) p − g)/D` in the distance q rolled, with the least D that damps disturbances. What is steady has s and g of the law.

use crate::contact::friction::velocity_weakening::Softening;
use crate::contact::rolling::history::plan::StepKind;

/// Distance in which bounds follow slips, over that above which disturbances die away; the weight of a step's own displacements, 1.5, counts
/// against it. With 2 a mesh of 16 × 32 is off by up to 0.029 of the friction limit, with 4 by 0.016, in the three histories of
/// `cargo test --test physics -- history_falling::finer --nocapture`.
const DAMPING: f64 = 4.0;

/// Bounds of the cells with unknowns.
pub(super) struct SlipFriction {
    fall: Softening,
    /// Without slip.
    rest: Vec<f64>,
    /// Of the next step of rolling.
    next: Vec<f64>,
    /// The distance D in mm.
    reach: f64,
}

impl SlipFriction {
    /// Bodies that have not slipped yet, with these bounds at rest.
    pub(super) fn new(fall: Softening, rest: &[f64]) -> SlipFriction {
        SlipFriction {
            fall,
            rest: rest.to_vec(),
            next: rest.to_vec(),
            reach: 0.0,
        }
    }

    /// The fall that a step follows at once, which only steady rolling does.
    pub(super) fn at_once(&self, kind: StepKind) -> Option<Softening> {
        (kind == StepKind::Steady).then_some(self.fall)
    }

    /// Finds the distance D. `gain` is by how much the slip of each cell falls in a step if all tractions grow by one, and `per_mm` the
    /// part of it that a displacement of one mm would have.
    pub(super) fn damp(&mut self, gain: &[f64], per_mm: f64) {
        let steepest = self.fall.steepest();
        let of_cell = |(gain, rest): (&f64, &f64)| steepest * rest * gain.abs();
        let most = gain.iter().zip(&self.rest).map(of_cell);
        self.reach = DAMPING * most.fold(0.0, f64::max) / per_mm;
    }

    /// Sets the bounds of a step. Bodies that shift do so slowly.
    pub(super) fn lay(&self, kind: StepKind, bounds: &mut [f64]) {
        bounds.copy_from_slice(match kind {
            StepKind::Roll { .. } => &self.next,
            StepKind::Steady | StepKind::Press | StepKind::Shift => &self.rest,
        });
    }

    /// Takes over the sizes of the slips that a step has led to, 0 where cells stick.
    pub(super) fn follow(&mut self, kind: StepKind, slips: &[f64]) {
        let share = match kind {
            StepKind::Shift | StepKind::Press => return self.next.clone_from(&self.rest),
            StepKind::Steady => 1.0,
            // Bounds of the next step follow slips of this one; with this share they lag by D in the mean, whatever the length of the steps.
            StepKind::Roll { distance, .. } => (distance / self.reach).min(1.0),
        };
        let cells = self.next.iter_mut().zip(&self.rest).zip(slips);
        for ((next, rest), slip) in cells {
            *next += share * (rest * self.fall.at(*slip).0 - *next);
        }
    }

    /// Bounds that belong to the slips of steady rolling, which has been taken over last.
    pub(super) fn settled(&self) -> &[f64] {
        &self.next
    }
}
