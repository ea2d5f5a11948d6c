//! How the steps of a run take part in friction that falls with slip.

use crate::contact::friction::velocity_weakening::Softening;
use crate::contact::rolling::history::level_run::LevelRun;
use crate::contact::rolling::history::plan::StepKind;
use crate::contact::rolling::history::step_equations::StepEquations;
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::slip_equations::SlipEquations;

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
